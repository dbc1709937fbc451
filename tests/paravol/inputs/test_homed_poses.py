import numpy as np
import pytest

from devices import DeviceError, DeviceReason, Pose
from devices.microscribe.driver.sampler import HomeState
from paravol.inputs.homed_poses import HomedPoses


class Arm:
    """An arm that gives its poses and then none."""

    def __init__(self, state: HomeState, poses: list[Pose]) -> None:
        self.home_state = state
        self.poses = poses
        self.asked: list[float] = []

    def read(self, timeout_s: float) -> Pose:
        self.asked.append(timeout_s)
        if self.poses:
            return self.poses.pop(0)
        raise TimeoutError("the arm said nothing")


def test_poses_pass() -> None:
    pose = Pose(1.0, 1.0, np.eye(4), 0)
    source = HomedPoses(Arm(HomeState.ASSUMED, [pose]))
    assert source.read(60.0) is pose


def test_an_arm_without_power_ends_the_wait_at_once() -> None:
    arm = Arm(HomeState.UNKNOWN, [])
    with pytest.raises(DeviceError, match="begin again") as caught:
        HomedPoses(arm).read(60.0)
    assert caught.value.reason is DeviceReason.NOT_HOMED
    assert len(arm.asked) == 1


def test_a_silent_arm_is_told_after_the_timeout() -> None:
    arm = Arm(HomeState.HOMED, [])
    with pytest.raises(TimeoutError):
        HomedPoses(arm).read(0.0)
    assert arm.asked == [0.0]
