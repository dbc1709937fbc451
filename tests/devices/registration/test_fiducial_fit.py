import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.pose import Pose
from devices.registration.fiducial_fit import (
    RegistrationError,
    RegistrationReason,
    register,
)
from devices.registration.rigid_fit import fit_rigid

# Bridge of the nose, cheeks, chin: as unsymmetrical as fiducials should be.
FACE = np.array(
    [[0.0, -85.0, 45.0], [38.0, -60.0, 20.0], [-45.0, -52.0, 26.0], [5.0, -90.0, -25.0]]
)
NAMES = ("bridge", "left", "right", "chin")


def _rotation(seed: int) -> NDArray[np.float64]:
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    q[:, 0] *= np.linalg.det(q)
    rotation: NDArray[np.float64] = q
    return rotation


seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_a_rigid_motion_is_found(seed: int) -> None:
    rotation = _rotation(seed)
    shift = np.random.default_rng(seed + 1).normal(size=3) * 500.0
    found = register((FACE - shift) @ rotation, FACE)
    np.testing.assert_allclose(found.world_from_device[:3, :3], rotation, atol=1e-9)
    np.testing.assert_allclose(found.world_from_device[:3, 3], shift, atol=1e-9)
    assert found.residual_rms_mm < 1e-9


@given(seeds)
def test_no_small_motion_fits_better(seed: int) -> None:
    rng = np.random.default_rng(seed)
    device = FACE @ _rotation(seed) + rng.normal(size=(4, 3)) * 0.3
    found = register(device, FACE)
    best = np.sum(found.residuals_mm**2)
    registered = device @ found.world_from_device[:3, :3].T
    registered = registered + found.world_from_device[:3, 3]
    for _ in range(10):
        turn, _ = np.linalg.qr(np.eye(3) + rng.normal(size=(3, 3)) * 1e-3)
        turn *= np.sign(np.diag(turn))
        moved = registered @ turn.T + rng.normal(size=3) * 1e-2
        assert np.sum((moved - FACE) ** 2) >= best


def test_residual_is_the_rms_of_the_residuals() -> None:
    device = FACE + np.random.default_rng(5).normal(size=(4, 3)) * 0.2
    found = register(device, FACE)
    expected = np.sqrt(np.mean(found.residuals_mm**2))
    assert found.residual_rms_mm == pytest.approx(expected)
    assert 0.02 < found.residual_rms_mm < 0.4


def test_the_tip_frame_is_carried_into_the_patient() -> None:
    found = register(FACE - (10.0, 20.0, 30.0), FACE)
    pose = Pose(0.0, 0.0, np.eye(4), 0)
    np.testing.assert_allclose(found.world_from_tip(pose)[:3, 3], (10, 20, 30))


def _reason(
    device: NDArray[np.float64], patient: NDArray[np.float64]
) -> tuple[RegistrationReason, str]:
    with pytest.raises(RegistrationError) as caught:
        register(device, patient, NAMES[: len(patient)])
    return caught.value.reason, str(caught.value)


def test_degenerate_sets_are_refused_by_name() -> None:
    assert _reason(FACE[:2], FACE[:2])[0] is RegistrationReason.TOO_FEW
    twice = FACE.copy()
    twice[2] = twice[1] + 0.3
    reason, text = _reason(twice, FACE)
    assert reason is RegistrationReason.COINCIDENT
    assert "'left' and 'right'" in text
    line = np.outer(np.arange(4.0), (10.0, 5.0, 2.0))
    assert _reason(line, line)[0] is RegistrationReason.COLLINEAR
    assert _reason(FACE, line)[0] is RegistrationReason.COLLINEAR


@given(seeds, st.sampled_from([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]))
def test_two_swapped_points_are_named(seed: int, pair: tuple[int, int]) -> None:
    rng = np.random.default_rng(seed)
    device = FACE @ _rotation(seed) + rng.normal(size=(4, 3)) * 0.1
    i, j = pair
    device[[i, j]] = device[[j, i]]
    reason, text = _reason(device, FACE)
    assert reason is RegistrationReason.SWAPPED
    assert [name for name in NAMES if repr(name) in text] == [NAMES[i], NAMES[j]]


@given(seeds)
def test_a_mirrored_set_is_refused(seed: int) -> None:
    device = (FACE * (-1.0, 1.0, 1.0)) @ _rotation(seed)
    assert _reason(device, FACE)[0] is RegistrationReason.REFLECTED


@given(seeds)
def test_the_rotation_is_never_a_reflection(seed: int) -> None:
    # Of the fit itself: a set as bad as this may be refused as swapped.
    device = np.random.default_rng(seed).normal(size=(4, 3)) * 50.0 + FACE
    transform, _ = fit_rigid(device, FACE, np.ones(4))
    assert np.linalg.det(transform[:3, :3]) == pytest.approx(1.0)


def test_a_bad_set_is_refused_with_its_residual() -> None:
    device = FACE.copy()
    device[1] += 20.0
    reason, text = _reason(device, FACE)
    assert reason is RegistrationReason.RESIDUAL
    assert "mm rms" in text


def test_wrong_shapes_are_the_callers_mistake() -> None:
    with pytest.raises(ValueError, match="needs its patient point"):
        register(FACE[:3], FACE)
    with pytest.raises(ValueError, match=r"shape \(n, 3\)"):
        register(FACE[:, :2], FACE)
    with pytest.raises(ValueError, match="finite"):
        register(FACE * np.nan, FACE)
    with pytest.raises(ValueError, match="as many names"):
        register(FACE, FACE, ("one",))
