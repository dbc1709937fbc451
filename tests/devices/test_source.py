"""The queue between who measures and who reads."""

import threading

import numpy as np
import pytest

from devices.port import DeviceError, DeviceReason
from devices.pose import Pose
from devices.source import LARGEST_QUEUE, PoseQueue


def pose(number: int) -> Pose:
    return Pose(float(number), float(number), np.eye(4), 0)


def test_every_pose_comes_once_and_in_order_and_latest_disturbs_nothing() -> None:
    queue = PoseQueue("the test")
    assert queue.latest() is None
    assert queue.newest_s() == -float("inf")
    for number in range(5):
        queue.put(pose(number))
    newest = queue.latest()
    assert newest is not None
    assert newest.time_s == queue.newest_s() == 4.0
    assert queue.read(0.0).time_s == 0.0
    assert [p.time_s for p in queue.drain()] == [1.0, 2.0, 3.0, 4.0]
    assert queue.latest() is newest
    with pytest.raises(TimeoutError, match="the test"):
        queue.read(0.0)


def test_a_waiting_reader_is_woken_by_a_pose_from_another_thread() -> None:
    queue = PoseQueue("the test")
    threading.Timer(0.05, queue.put, [pose(1)]).start()
    # Without the wake-up the wait would outlast the test's own limit.
    assert queue.read(float("inf")).time_s == 1.0


def test_what_came_before_a_failure_or_the_end_is_read_first() -> None:
    failed, ended = PoseQueue("the test"), PoseQueue("the test")
    for queue in (failed, ended):
        queue.put(pose(1))
        queue.put(pose(2))
    failed.fail(DeviceError(DeviceReason.DISCONNECTED, "It went away."))
    ended.end()
    assert [failed.read(0.0).time_s, failed.read(0.0).time_s] == [1.0, 2.0]
    assert len(ended.drain()) == 2
    for refused in (failed.drain, failed.latest, lambda: failed.read(9.0)):
        with pytest.raises(DeviceError, match="went away"):
            refused()
    with pytest.raises(EOFError, match="the test was closed"):
        ended.read(9.0)


def test_poses_that_nobody_read_are_lost_and_confessed_once() -> None:
    queue = PoseQueue("the test")
    for number in range(LARGEST_QUEUE + 3):
        queue.put(pose(number))
    with pytest.raises(DeviceError, match="3 poses") as caught:
        queue.drain()
    assert caught.value.reason is DeviceReason.OVERRUN
    assert queue.read(0.0).time_s == 3.0
    queue.clear()
    assert queue.latest() is None
