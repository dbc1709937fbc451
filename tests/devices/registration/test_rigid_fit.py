import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.registration.rigid_fit import (
    best_other_order,
    closest_other_order,
    fit_rigid,
    rms,
)

FACE = np.array(
    [[0.0, -85.0, 45.0], [38.0, -60.0, 20.0], [-45.0, -52.0, 26.0], [5.0, -90.0, -25.0]]
)
seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_weights_are_like_repeated_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    source = FACE + rng.normal(size=FACE.shape)
    weighted, _ = fit_rigid(source, FACE, np.array([2.0, 1.0, 3.0, 1.0]))
    index = [0, 0, 1, 2, 2, 2, 3]
    repeated, _ = fit_rigid(source[index], FACE[index], np.ones(7))
    np.testing.assert_allclose(weighted, repeated, atol=1e-9)


@given(seeds)
def test_the_unit_of_the_weights_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    source = FACE + rng.normal(size=FACE.shape)
    weights = rng.uniform(0.1, 1.0, 4)
    one, _ = fit_rigid(source, FACE, weights)
    other, _ = fit_rigid(source, FACE, 1e6 * weights)
    np.testing.assert_allclose(one, other, atol=1e-9)


def test_a_mistrusted_point_hardly_pulls() -> None:
    source = FACE.copy()
    source[3] += (0.0, 0.0, 5.0)
    free, _ = fit_rigid(source, FACE, np.array([1.0, 1.0, 1.0, 1e-9]))
    np.testing.assert_allclose(free, np.eye(4), atol=1e-6)


@given(seeds)
def test_batches_agree_with_single_fits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sources = FACE + rng.normal(size=(3, 4, 3))
    batch, residuals = fit_rigid(sources, FACE, np.ones(4))
    for i in range(3):
        one, residual = fit_rigid(sources[i], FACE, np.ones(4))
        np.testing.assert_allclose(batch[i], one, atol=1e-10)
        np.testing.assert_allclose(residuals[i], residual, atol=1e-10)


@given(seeds, st.booleans())
def test_the_handedness_is_the_wanted_one(seed: int, mirror: bool) -> None:
    source = np.random.default_rng(seed).normal(size=(4, 3)) * 50.0
    transform, _ = fit_rigid(source, FACE, np.ones(4), mirror=mirror)
    sign = -1.0 if mirror else 1.0
    assert np.linalg.det(transform[:3, :3]) == pytest.approx(sign)


@pytest.mark.parametrize("count", [3, 4, 6, 8])
def test_residual_of_noise_is_that_of_the_formula(count: int) -> None:
    # FRE^2 = (1 - 2 / n) FLE^2 (Sibson, 1979).
    rng = np.random.default_rng(count)
    points = rng.normal(size=(count, 3)) * 40.0
    noise = rng.normal(size=(4000, count, 3)) * 0.5 / np.sqrt(3.0)
    _, residuals = fit_rigid(points + noise, points, np.ones(count))
    assert rms(residuals) == pytest.approx(0.5 * np.sqrt(1 - 2 / count), rel=0.01)


def test_the_other_order_with_the_fewest_moves_is_named() -> None:
    swapped = FACE[[0, 2, 1, 3]]
    assert best_other_order(swapped, FACE, np.ones(4), 1.0) == (0, 2, 1, 3)
    assert best_other_order(FACE, FACE, np.ones(4), 1.0) is None


def test_symmetry_is_found() -> None:
    kite = np.array([[30.0, 0, 0], [-30.0, 0, 0], [0, 0, 40.0], [0, 0, -20.0]])
    order, residual = closest_other_order(kite)
    assert order == (1, 0, 2, 3)
    assert residual < 1e-9
    assert closest_other_order(FACE)[1] > 5.0
