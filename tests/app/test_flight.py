"""Poses on their way into frames."""

import itertools
import time

import numpy as np

from app.flight import _arrived
from devices import Pose


def pose(host_time_s: float) -> Pose:
    return Pose(host_time_s, host_time_s, np.eye(4), 0)


class Waiting:
    """Poses that are there already."""

    def __init__(self, poses: list[Pose]) -> None:
        self.poses = poses

    def read(self, timeout_s: float) -> Pose:
        if not self.poses:
            raise TimeoutError("silence")
        return self.poses.pop(0)


class Endless:
    """A device that has measured again whenever it is asked."""

    def read(self, timeout_s: float) -> Pose:
        return pose(time.monotonic())


def test_a_frame_takes_all_poses_that_are_there() -> None:
    now = time.monotonic()
    sent = [pose(now - 0.01 * (9 - i)) for i in range(10)]
    assert list(_arrived(Waiting(sent.copy()))) == sent


def test_a_frame_is_drawn_however_fast_poses_come() -> None:
    """Those who are slower than the device fall behind, but they come to an end."""
    taken = list(itertools.islice(_arrived(Endless()), 1000))
    assert len(taken) < 5


def test_no_pose_is_lost_between_two_frames() -> None:
    now = time.monotonic()
    # measured before and after the look
    sent = [pose(now - 1.0), pose(now + 50.0), pose(now + 100.0)]
    source = Waiting(sent.copy())
    assert list(_arrived(source)) == sent[:2]
    assert list(_arrived(source)) == sent[2:]
