"""Propagated target errors against Fitzpatrick's formula and against dice."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.registration.fiducial_fit import RegistrationError, RegistrationReason
from devices.registration.rigid_fit import fit_rigid
from devices.registration.target_error import (
    FitUncertainty,
    PointErrors,
    fitzpatrick_rms_mm,
    moves,
    over_budget,
    refuse_weak_targets,
    rms_mm,
)

TARGETS = np.array([[0.0, 40.0, 10.0], [15.0, 60.0, 30.0], [-13.0, 27.0, 23.0]])
seeds = st.integers(0, 2**32 - 1)


def _points(count: int, seed: int) -> NDArray[np.float64]:
    return np.random.default_rng(seed).normal(size=(count, 3)) * (40.0, 15.0, 30.0)


def _weights(count: int) -> NDArray[np.float64]:
    return np.broadcast_to(np.eye(3), (count, 3, 3))


@given(st.integers(3, 9), seeds)
def test_equal_errors_give_fitzpatrick_s_formula(count: int, seed: int) -> None:
    points = _points(count, seed)
    errors = PointErrors.isotropic(count, 0.5)
    fit = FitUncertainty.of(points, _weights(count), errors)
    np.testing.assert_allclose(
        rms_mm(fit.covariance(TARGETS)),
        fitzpatrick_rms_mm(points, TARGETS, 0.5),
        rtol=1e-6,
    )


@pytest.mark.parametrize("count", [3, 4, 6, 8])
def test_dice_agree_with_the_formula_and_the_residual_knows_nothing(count: int) -> None:
    points = np.random.default_rng(count).normal(size=(count, 3)) * (40.0, 15.0, 30.0)
    rng = np.random.default_rng(11)
    noise = rng.normal(size=(40000, count, 3)) * 0.5 / np.sqrt(3.0)
    found, residuals = fit_rigid(points + noise, points, np.ones(count))
    at = TARGETS @ np.swapaxes(found[:, :3, :3], 1, 2) + found[:, None, :3, 3]
    off = np.linalg.norm(at - TARGETS, axis=2)
    rolled = np.sqrt(np.mean(off**2, axis=0))
    np.testing.assert_allclose(
        rolled, fitzpatrick_rms_mm(points, TARGETS, 0.5), rtol=0.015
    )
    fre = np.sqrt(np.mean(residuals**2, axis=1))
    assert abs(np.corrcoef(fre, off[:, 0])[0, 1]) < 0.03


def test_dice_agree_with_uneven_and_shared_errors() -> None:
    rng = np.random.default_rng(5)
    count, causes = 6, 4
    points = _points(count, 1)
    half = rng.normal(size=(count, 3, 3)) * 0.2
    common = rng.normal(size=(count, 3, causes)) * 0.1
    errors = PointErrors(half @ half.transpose(0, 2, 1), common)
    at_targets = PointErrors(
        np.broadcast_to(np.eye(3) * 0.01, (3, 3, 3)), rng.normal(size=(3, 3, causes))
    )
    weights = rng.uniform(0.5, 2.0, count)
    fit = FitUncertainty.of(points, weights[:, None, None] * _weights(count), errors)
    own = np.einsum("nij,snj->sni", half, rng.normal(size=(20000, count, 3)))
    shared = rng.normal(size=(20000, causes))
    touched = points + own + np.einsum("nik,sk->sni", common, shared)
    found, _ = fit_rigid(touched, points, weights)
    tool = TARGETS + np.einsum("mik,sk->smi", at_targets.common, shared)
    tool += rng.normal(size=tool.shape) * 0.1
    shown = tool @ np.swapaxes(found[:, :3, :3], 1, 2) + found[:, None, :3, 3]
    for i, wanted in enumerate(fit.covariance(TARGETS, at_targets)):
        off = shown[:, i] - TARGETS[i]
        rolled = off.T @ off / len(off)
        assert np.abs(rolled - wanted).max() < 0.05 * np.trace(wanted)


def test_a_cause_that_moves_everything_rigidly_is_registered_away() -> None:
    points = _points(5, 3)
    motion = np.random.default_rng(8).normal(size=(6, 6))
    errors = PointErrors(np.zeros((5, 3, 3)), moves(points, np.zeros(3)) @ motion)
    tool = PointErrors(np.zeros((3, 3, 3)), moves(TARGETS, np.zeros(3)) @ motion)
    fit = FitUncertainty.of(points, _weights(5), errors)
    assert rms_mm(fit.covariance(TARGETS, tool)).max() < 1e-9
    assert rms_mm(fit.covariance(TARGETS)).min() > 1.0


@given(seeds)
def test_more_points_never_make_it_worse(seed: int) -> None:
    points = _points(8, seed)
    few = fitzpatrick_rms_mm(points[:5], TARGETS, 0.5)
    errors = PointErrors.isotropic(8, 0.5)
    weights = np.broadcast_to(np.eye(3) / (0.25 / 3), (8, 3, 3))
    more = rms_mm(FitUncertainty.of(points, weights, errors).covariance(TARGETS))
    assert (more <= few * (1 + 1e-9)).all()


def test_points_on_one_line_leave_a_turn_free() -> None:
    line = np.outer(np.arange(4.0), (10.0, 5.0, 2.0))
    with pytest.raises(RegistrationError) as caught:
        FitUncertainty.of(line, _weights(4), PointErrors.isotropic(4, 0.5))
    assert caught.value.reason is RegistrationReason.COLLINEAR


def test_nearly_on_a_line_the_targets_say_how_bad_it_is() -> None:
    near = np.outer(np.arange(4.0) - 1.5, (25.0, 0.0, 0.0))
    near[1, 2] = 5.0
    errors = PointErrors.isotropic(4, 0.5)
    found = rms_mm(FitUncertainty.of(near, _weights(4), errors).covariance(TARGETS))
    by_name = dict(zip(("pharynx", "sphenoid", "ostium"), found.tolist(), strict=True))
    with pytest.raises(RegistrationError, match="'sphenoid'") as caught:
        refuse_weak_targets(by_name)
    assert caught.value.reason is RegistrationReason.TARGET


def test_the_budget_names_the_worst_first() -> None:
    found = {"near": 0.3, "far": 0.9, "farther": 1.4}
    assert over_budget(found) == ["farther", "far"]
    refuse_weak_targets(found)
    with pytest.raises(RegistrationError, match="'lost'"):
        refuse_weak_targets({**found, "lost": float("nan")}, 2.0)


def test_shapes_are_checked() -> None:
    with pytest.raises(ValueError, match=r"noise must be \(n, 3, 3\)"):
        PointErrors(np.zeros((4, 3)), np.zeros((4, 3, 0)))
    with pytest.raises(ValueError, match="common must be"):
        PointErrors(np.zeros((4, 3, 3)), np.zeros((3, 3, 2)))
    fit = FitUncertainty.of(_points(4, 0), _weights(4), PointErrors.isotropic(4, 1.0))
    with pytest.raises(ValueError, match="shared causes"):
        fit.covariance(TARGETS, PointErrors.isotropic(3, 1.0, causes=2))
