from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.pose import Pose
from devices.registration.pivot import (
    PivotError,
    PivotReason,
    calibrate_pivot,
    half_cone_deg,
    shifted_to_tip,
)

TIP = np.array([1.5, -2.0, -23.0])
POINT = np.array([120.0, -80.0, 60.0])


def _frames(
    half_deg: float, count: int, seed: int, noise_mm: float = 0.0, rolled: bool = False
) -> NDArray[np.float64]:
    """Turn a tool about POINT, its axis uniform over a cone about -y."""
    rng = np.random.default_rng(seed)
    lowest = np.cos(np.radians(half_deg))
    tilt = np.arccos(rng.uniform(lowest, 1.0, count))
    around = rng.uniform(0.0, 2.0 * np.pi, count)
    vector = np.stack((np.cos(around), np.sin(around), 0.0 * around), 1) * tilt[:, None]
    turn = Rotation.from_euler("x", 90.0, degrees=True) * Rotation.from_rotvec(vector)
    if rolled:
        spin = np.zeros((count, 3))
        spin[:, 2] = rng.uniform(0.0, 2.0 * np.pi, count)
        turn = turn * Rotation.from_rotvec(spin)
    frames = np.tile(np.eye(4), (count, 1, 1))
    frames[:, :3, :3] = turn.as_matrix()
    frames[:, :3, 3] = POINT - turn.apply(TIP) + rng.normal(size=(count, 3)) * noise_mm
    return frames


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.floats(20.0, 60.0))
def test_exact_poses_give_the_tip_back(seed: int, half_deg: float) -> None:
    found = calibrate_pivot(_frames(half_deg, 100, seed))
    np.testing.assert_allclose(found.tip_mm, TIP, atol=1e-9)
    np.testing.assert_allclose(found.point_mm, POINT, atol=1e-9)
    assert found.residual_mm < 1e-9


# Half cone, condition, tip error in mm rms: 100 poses, 0.1 mm of noise per axis.
CONES = [(5.0, 51.0, 0.37), (15.0, 17.0, 0.12), (30.0, 8.4, 0.062), (60.0, 4.6, 0.033)]


@pytest.mark.parametrize(("half_deg", "condition", "error_mm"), CONES)
def test_the_cone_decides_and_the_residual_is_silent(
    half_deg: float, condition: float, error_mm: float
) -> None:
    off, told, residuals, conditions = [], [], [], []
    for seed in range(150):
        frames = _frames(half_deg, 100, seed, 0.1)
        found = calibrate_pivot(frames, largest_condition=1e3)
        off.append(np.sum((found.tip_mm - TIP) ** 2))
        told.append(np.trace(found.covariance))
        residuals.append(found.residual_mm)
        conditions.append(found.condition)
    assert np.mean(conditions) == pytest.approx(condition, rel=0.1)
    assert np.sqrt(np.mean(off)) == pytest.approx(error_mm, rel=0.12)
    assert np.sqrt(np.mean(told)) == pytest.approx(np.sqrt(np.mean(off)), rel=0.12)
    assert np.mean(residuals) == pytest.approx(0.1, rel=0.02)


def _reason(frames: NDArray[np.float64], **options: Any) -> PivotReason:
    with pytest.raises(PivotError) as caught:
        calibrate_pivot(frames, noise_mm=0.1, **options)
    return caught.value.reason


def test_refusals() -> None:
    assert _reason(_frames(40.0, 99, 1)) is PivotReason.TOO_FEW
    assert _reason(_frames(5.0, 200, 1, 0.1)) is PivotReason.TOO_NARROW
    assert _reason(_frames(0.0, 200, 1, 0.1)) is PivotReason.TOO_NARROW
    assert _reason(_frames(40.0, 200, 1, 0.3)) is PivotReason.RESIDUAL
    slipped = _frames(40.0, 200, 1, 0.05)
    slipped[100:, :3, 3] += (2.0, 0.0, 0.0)
    assert _reason(slipped) is PivotReason.RESIDUAL


def test_a_rolled_tool_still_shows_its_length() -> None:
    straight = _frames(40.0, 200, 3, rolled=True)
    # The arm does not know the roll: it reports frames turned back about their axis.
    side = straight[:, :3, :3] @ np.array([TIP[0], TIP[1], 0.0])
    straight[:, :3, 3] += side
    found = calibrate_pivot(straight, along_axis=True)
    np.testing.assert_allclose(found.tip_mm, (0.0, 0.0, TIP[2]), atol=1e-9)
    assert np.trace(found.covariance) == found.covariance[2, 2]


def test_the_calibrated_tip_moves_the_pose() -> None:
    frames = _frames(40.0, 150, 3)
    found = calibrate_pivot(frames)
    for frame in frames[:5]:
        pose = Pose(0.0, 0.0, frame, 1)
        np.testing.assert_allclose(
            shifted_to_tip(pose, found.tip_mm).tip_mm, POINT, atol=1e-9
        )
        np.testing.assert_array_equal(
            shifted_to_tip(pose, np.zeros(3)).device_from_tip, frame
        )


def test_the_cone_is_measured() -> None:
    assert half_cone_deg(_frames(30.0, 2000, 2)) == pytest.approx(30.0, abs=1.5)
    opposite = _frames(0.0, 2, 0)
    opposite[1, :3, 1:3] *= -1.0
    assert half_cone_deg(opposite) == 180.0


def test_frames_must_be_frames() -> None:
    with pytest.raises(ValueError, match=r"\(n, 4, 4\)"):
        calibrate_pivot(np.eye(4))
