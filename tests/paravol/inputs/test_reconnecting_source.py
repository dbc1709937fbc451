"""Poses through losses: all of them, in order, and every absence told once."""

import math
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices import DeviceError, DeviceReason, Pose
from devices.microscribe import MicroScribe
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.in_memory import EmulatedPort, MemoryLine, SystemClock
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937
from paravol.inputs.reconnecting_source import LastingPoses


def pose(time_s: float) -> Pose:
    return Pose(time_s, time_s, np.eye(4), 0)


class Source:
    """What reads give, in order: a pose, a loss, or None for silence."""

    def __init__(self, answers: list[Pose | DeviceError | None]) -> None:
        self.answers = answers

    def read(self, timeout_s: float) -> Pose:
        if not self.answers:
            raise EOFError
        answer = self.answers.pop(0)
        if answer is None:
            raise TimeoutError("silence")
        if isinstance(answer, DeviceError):
            raise answer
        return answer


def loss() -> DeviceError:
    return DeviceError(DeviceReason.DISCONNECTED, "It went away.")


@given(st.lists(st.tuples(st.integers(1, 4), st.integers(1, 4)), max_size=6))
def test_no_pose_is_lost_and_every_absence_is_told(
    stretches: list[tuple[int, int]],
) -> None:
    """For every alternation of presence and absence."""
    answers: list[Pose | DeviceError | None] = []
    sent: list[Pose] = []
    for present, absent in stretches:
        for _ in range(present):
            sent.append(pose(float(len(sent) ** 2)))
            answers.append(sent[-1])
        # at least one silence: the driver that looks for its arm has no poses
        answers += [loss(), *[None] * absent]
    story: list[str] = []
    source = Source(answers)
    lasting = LastingPoses(
        source,
        on_loss=lambda _: story.append("lost"),
        on_return=lambda gap_s: story.append(f"back {gap_s:g}"),
    )
    came = [lasting.read(1.0) for _ in sent]
    with pytest.raises(EOFError):
        lasting.read(1.0)
    assert came == sent
    ends = np.cumsum([present for present, _ in stretches])
    expected = []
    for i, end in enumerate(ends):
        expected.append("lost")
        if i + 1 < len(ends):
            expected.append(f"back {float(end**2 - (end - 1) ** 2):g}")
    assert story == expected


def test_a_pose_that_comes_with_the_loss_is_not_lost() -> None:
    gaps: list[float] = []
    lasting = LastingPoses(Source([loss(), pose(3.0)]), on_return=gaps.append)
    assert lasting.read(1.0).time_s == 3.0
    assert gaps == [0.0]


def test_a_device_that_nobody_looks_for_fails_at_once_and_untold() -> None:
    told: list[DeviceError] = []
    lasting = LastingPoses(Source([loss(), loss()]), on_loss=told.append)
    with pytest.raises(DeviceError, match="went away"):
        lasting.read(1.0)
    assert not told


def test_a_second_failure_ends_the_wait() -> None:
    unhomed = DeviceError(DeviceReason.NOT_HOMED, "Home it.")
    lasting = LastingPoses(Source([loss(), None, None, unhomed]))
    with pytest.raises(DeviceError, match="Home it"):
        lasting.read(1.0)


def test_a_present_device_may_not_be_silent_but_an_absent_one_may() -> None:
    lasting = LastingPoses(Source([None, loss(), None, None, pose(1.0)]))
    with pytest.raises(TimeoutError):
        lasting.read(1.0)
    # told to look only, it does not wait
    with pytest.raises(TimeoutError):
        lasting.read(0.0)
    assert lasting.read(1.0).time_s == 1.0


def test_patience_ends_with_the_loss() -> None:
    lasting = LastingPoses(Source([loss(), None, None]), patience_s=0.0)
    with pytest.raises(DeviceError, match="went away"):
        lasting.read(1.0)


class Plug:
    """A machine with one emulated arm."""

    def __init__(self) -> None:
        arm = EmulatedArm(DX40937, StillMotion(DX40937), now_s=time.monotonic())
        self.line = MemoryLine(arm, SystemClock())

    def names(self) -> list[str]:
        return [self.line.name] if self.line.arm.plugged else []

    def open(self, name: str) -> EmulatedPort:
        return self.line.open_port()

    def move(self, is_in: bool) -> None:
        arm = self.line.arm
        with self.line.changed:
            (arm.replug if is_in else arm.unplug)(time.monotonic())
            self.line.changed.notify_all()


def test_the_drivers_own_losses_are_survived() -> None:
    plug = Plug()
    story: list[str] = []
    with MicroScribe(plug.line.open_port(), replug=plug) as arm:

        def on_loss(_: DeviceError) -> None:
            story.append("lost")
            plug.move(is_in=True)

        lasting = LastingPoses(
            arm, math.inf, on_loss, on_return=lambda gap_s: story.append("back")
        )
        before = lasting.read(5.0)
        plug.move(is_in=False)
        # Poses that were measured before the plug was pulled come first.
        while "back" not in story:
            after = lasting.read(5.0)
        assert after.time_s > before.time_s
    assert story == ["lost", "back"]
