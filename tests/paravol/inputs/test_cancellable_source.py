"""What stands between an arm and the flight that a window watches."""

import threading
import time

import numpy as np
import pytest

from devices import Pose
from paravol.inputs.cancellable_source import (
    CancellableSource,
    ClosedError,
    KeyboardRoll,
)
from scenarios import Sample


def pose(time_s: float) -> Pose:
    return Pose(
        time_s=time_s,
        host_time_s=time.monotonic(),
        device_from_tip=np.eye(4),
        buttons=0,
    )


class Arm:
    """Poses that are there already, then silence."""

    def __init__(self, count: int) -> None:
        self._poses = [pose(i / 100) for i in range(count)]

    def read(self, timeout_s: float) -> Pose:
        if self._poses:
            return self._poses.pop(0)
        time.sleep(timeout_s)
        raise TimeoutError("silence")


class Aim:
    def complete(self, pose: Pose) -> Sample:
        return Sample(
            pose.time_s, pose.device_from_tip, 30.0, np.zeros(3), np.zeros(3), 0
        )


def test_poses_pass_in_order_and_silence_is_told() -> None:
    source = CancellableSource(Arm(5), threading.Event())
    assert [source.read(1.0).time_s for _ in range(5)] == [i / 100 for i in range(5)]
    with pytest.raises(TimeoutError, match="silence"):
        source.read(0.0)
    with pytest.raises(TimeoutError, match="silence"):
        source.read(0.25)


def test_closing_ends_a_wait_for_a_silent_arm() -> None:
    closed = threading.Event()
    source = CancellableSource(Arm(0), closed)
    threading.Timer(0.05, closed.set).start()
    # Without the event the wait would outlast the test's own limit.
    with pytest.raises(ClosedError):
        source.read(1e6)


def test_the_keyboard_turns_on_top_of_the_channel() -> None:
    roll = KeyboardRoll(Aim())
    assert roll.complete(pose(0.0)).roll_deg == 30.0
    roll.turn_deg -= 5.0
    assert roll.complete(pose(0.1)).roll_deg == 25.0
