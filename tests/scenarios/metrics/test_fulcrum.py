import numpy as np
import pytest
from numpy.typing import NDArray

from scenarios.metrics import Settings
from scenarios.metrics.fulcrum import (
    nostril_excursion_mm,
    pivot_condition,
    pivot_drift_mm,
    pivot_of,
    pivot_residual_mm,
)
from tests.scenarios.metrics.tracks import of_scope, track

PIVOT = np.array([6.0, -13.0, -6.5])


def cone(
    half_deg: float, count: int = 500, seed: int = 1
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Tips and pointing directions of a shaft through a pivot, 40 to 60 mm deep."""
    rng = np.random.default_rng(seed)
    angle = np.radians(half_deg) * np.sqrt(rng.uniform(size=count))
    around = rng.uniform(0, 2 * np.pi, count)
    axis = np.stack(
        [np.sin(angle) * np.cos(around), np.cos(angle), np.sin(angle) * np.sin(around)],
        axis=1,
    )
    return PIVOT + rng.uniform(40, 60, count)[:, None] * axis, axis


def test_axes_through_a_point_find_it() -> None:
    tips, axis = cone(20.0)
    found = pivot_of(tips, axis)
    assert found is not None
    assert found.at_mm == pytest.approx(PIVOT, abs=1e-9)
    assert found.residual_mm == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("half_deg", "error_mm", "condition"),
    [(30.0, 0.02, 7), (10.0, 0.05, 66), (3.0, 0.30, 730), (0.5, 8.6, 22_000)],
)
def test_the_condition_tells_what_the_residual_hides(
    half_deg: float, error_mm: float, condition: float
) -> None:
    rng = np.random.default_rng(7)
    errors, conditions, residuals = [], [], []
    for seed in range(20):
        tips, axis = cone(half_deg, seed=seed)
        axis = axis + 0.002 * rng.standard_normal(axis.shape)
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        found = pivot_of(tips + 0.1 * rng.standard_normal(tips.shape), axis)
        assert found is not None
        errors.append(float(np.linalg.norm(found.at_mm - PIVOT)))
        conditions.append(found.condition)
        residuals.append(found.residual_mm)
    # the order of magnitude: how a cone is filled changes both by a small factor
    assert 0.3 * error_mm < np.sqrt(np.mean(np.square(errors))) < 3 * error_mm
    assert 0.4 * condition < np.median(conditions) < 2.5 * condition
    assert np.mean(residuals) == pytest.approx(0.19, abs=0.03)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_axes_have_no_pivot(count: int) -> None:
    tips, axis = cone(20.0)
    assert pivot_of(tips[:count], axis[:count]) is None


def test_parallel_axes_have_no_pivot() -> None:
    tips, _ = cone(20.0)
    assert pivot_of(tips, np.tile([0.0, 1.0, 0.0], (len(tips), 1))) is None


def test_a_weak_pivot_is_refused_with_its_condition() -> None:
    tips, axis = cone(0.5)
    measured = of_scope(track(np.arange(500) / 100, tips, axis))
    for compute in (pivot_residual_mm, pivot_drift_mm, nostril_excursion_mm):
        found = compute(measured)
        assert found.value is None
        assert "condition" in found.reason
    told = pivot_condition(measured).value
    assert told is not None
    assert told > Settings().largest_condition


def test_a_shaft_that_leaves_the_nostril_shows_when() -> None:
    tips, axis = cone(20.0)
    tips[250] += 4.0 * np.cross(axis[250], [1.0, 0.0, 0.0])
    found = nostril_excursion_mm(of_scope(track(np.arange(500) / 100, tips, axis)))
    assert found.value == pytest.approx(4.0, abs=0.3)
    assert found.intervals == ((2.5, 2.5),)


def test_a_pivot_that_moves_drifts() -> None:
    tips, axis = cone(20.0)
    shifted = tips + np.where(np.arange(500) >= 375, 3.0, 0.0)[:, None] * [1, 0, 0]
    measured = of_scope(track(np.arange(500) / 100, shifted, axis))
    assert pivot_drift_mm(measured).value == pytest.approx(3.0, abs=1e-6)
    still = of_scope(track(np.arange(500) / 100, tips, axis))
    assert pivot_drift_mm(still).value == pytest.approx(0.0, abs=1e-6)
