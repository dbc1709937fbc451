import threading
from types import SimpleNamespace

import numpy as np
import pytest

from devices import pose_queue
from devices.microscribe.emulator.in_memory import DrivenClock
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose
from devices.pose_queue import PoseQueue

LOSS = DeviceError(DeviceReason.DISCONNECTED, "The arm went away.")


def _poses(count: int) -> list[Pose]:
    return [Pose(float(i), float(i), np.eye(4), 0) for i in range(count)]


def _queue() -> PoseQueue:
    return PoseQueue("the test")


def test_every_pose_once_and_in_order() -> None:
    queue, poses = _queue(), _poses(4)
    assert queue.latest() is None
    assert queue.newest_s() == -float("inf")
    queue.put(poses[:3])
    queue.put(poses[3:])
    assert [queue.read(0.0), queue.read(0.0)] == poses[:2]
    assert queue.latest() is poses[3]
    assert queue.newest_s() == 3.0
    assert queue.drain() == poses[2:]
    assert queue.drain() == []
    with pytest.raises(TimeoutError, match="the test"):
        queue.read(0.001)


def test_a_silence_is_told_with_its_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is told is the wait itself: by a busy machine's clock it is any length."""
    clock = DrivenClock(100.0)
    monkeypatch.setattr(pose_queue, "time", SimpleNamespace(monotonic=clock.now))
    queue = PoseQueue("the test", silence=lambda s: f"{s:g} s: the plug.")
    for passed_s, told in ((0.0, "0.01"), (0.59, "0.59"), (0.5, "1.09")):
        clock.sleep(passed_s)
        with pytest.raises(TimeoutError, match=rf"^{told} s: the plug\."):
            queue.read(0.01)


def test_a_loss_comes_behind_the_poses_before_it_and_once() -> None:
    queue, poses = _queue(), _poses(2)
    queue.put(poses)
    queue.tell(LOSS)
    assert queue.drain() == poses
    with pytest.raises(DeviceError, match="went away"):
        queue.read(1.0)
    assert queue.drain() == []
    assert queue.latest() is poses[1]


def test_poses_nobody_read_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pose_queue, "LARGEST_QUEUE", 3)
    queue, poses = _queue(), _poses(5)
    queue.put(poses)
    with pytest.raises(DeviceError, match="2 poses were lost"):
        queue.read(0.0)
    assert queue.drain() == poses[2:]


def test_a_reader_is_woken_by_a_pose() -> None:
    queue, poses = _queue(), _poses(1)
    threading.Timer(0.01, queue.put, (poses,)).start()
    assert queue.read(30.0) is poses[0]
    assert not queue.is_awaited


def test_what_came_before_a_failure_or_the_end_is_read_first() -> None:
    failed, ended = PoseQueue("the test"), PoseQueue("the test")
    for queue in (failed, ended):
        queue.put(_poses(3)[1:])
    failed.fail(DeviceError(DeviceReason.DISCONNECTED, "It went away."))
    ended.end()
    assert [failed.read(0.0).time_s, failed.read(0.0).time_s] == [1.0, 2.0]
    assert len(ended.drain()) == 2
    for refused in (failed.drain, failed.latest, lambda: failed.read(9.0)):
        with pytest.raises(DeviceError, match="went away"):
            refused()
    with pytest.raises(EOFError, match="the test was closed"):
        ended.read(9.0)
