import numpy as np
import pytest
from numpy.typing import NDArray

from devices.pose import Pose
from devices.registration.held_point import HeldPoint, HoldError, HoldReason

POINT = np.array([120.0, -40.0, 75.0])


def _held(
    count: int, shake_mm: float, seed: int = 0, step_s: float = 0.1
) -> list[Pose]:
    rng = np.random.default_rng(seed)
    poses = []
    for i in range(count):
        frame = np.eye(4)
        frame[:3, 3] = POINT + rng.normal(size=3) * shake_mm
        poses.append(Pose(step_s * i, step_s * i, frame, 1))
    return poses


def _off(point: HeldPoint) -> NDArray[np.float64]:
    off: NDArray[np.float64] = point.tip_mm - POINT
    return off


def test_the_point_is_the_mean_and_its_noise_is_told() -> None:
    points = [HeldPoint.of(_held(100, 0.2, seed)) for seed in range(300)]
    scatter = np.cov(np.array([_off(p) for p in points]).T)
    told = np.mean([p.noise for p in points], axis=0)
    np.testing.assert_allclose(told, scatter, atol=0.2 * float(np.trace(told)))
    shake = np.mean([p.shake_mm for p in points])
    assert shake == pytest.approx(0.2 * np.sqrt(3.0), rel=0.03)


def test_more_poses_of_the_same_shake_tell_nothing_new() -> None:
    slow = HeldPoint.of(_held(100, 0.2))
    fast = HeldPoint.of(_held(1000, 0.2, step_s=0.01))
    ratio = np.trace(fast.noise) / np.trace(slow.noise)
    assert ratio == pytest.approx(1.0, abs=0.35)


def test_pressing_and_releasing_do_not_count() -> None:
    poses = _held(50, 0.0)
    for i in (0, 1, 48, 49):
        frame = np.eye(4)
        frame[:3, 3] = POINT + np.array([20.0, 0.0, 0.0])
        poses[i] = Pose(0.1 * i, 0.1 * i, frame, 1)
    np.testing.assert_allclose(_off(HeldPoint.of(poses)), 0.0, atol=1e-12)


def test_refusals() -> None:
    with pytest.raises(HoldError) as caught:
        HeldPoint.of(_held(12, 0.0))
    assert caught.value.reason is HoldReason.TOO_SHORT
    with pytest.raises(HoldError, match="moved by") as caught:
        HeldPoint.of(_held(100, 3.0))
    assert caught.value.reason is HoldReason.SLIPPED
