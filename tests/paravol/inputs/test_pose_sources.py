"""Poses through losses, ends and power cuts: all of them, in order, each told once."""

import math
import threading
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices import DeviceError, DeviceReason, Pose
from devices.microscribe import MicroScribe
from devices.microscribe.driver.sampler import HomeState
from paravol.inputs.pose_sources import (
    CancellableSource,
    ClosedError,
    HomedSource,
    ReconnectingSource,
)
from tests.devices.plugged_arm import Plug


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
    lasting = ReconnectingSource(
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
    lasting = ReconnectingSource(Source([loss(), pose(3.0)]), on_return=gaps.append)
    assert lasting.read(1.0).time_s == 3.0
    assert gaps == [0.0]


def test_a_device_that_nobody_looks_for_fails_at_once_and_untold() -> None:
    told: list[DeviceError] = []
    lasting = ReconnectingSource(Source([loss(), loss()]), on_loss=told.append)
    with pytest.raises(DeviceError, match="went away"):
        lasting.read(1.0)
    assert not told


def test_poses_that_nobody_read_in_time_end_no_flight() -> None:
    """A reader so late loses more while it is told: that is no lost device."""
    late = DeviceError(DeviceReason.OVERRUN, "25213 poses were lost.")
    told: list[str] = []
    losses: list[DeviceError] = []
    lasting = ReconnectingSource(
        Source([pose(1.0), late, late, pose(2.0), late, pose(3.0)]),
        on_loss=losses.append,
        on_late=told.append,
    )
    assert [lasting.read(1.0).time_s for _ in range(3)] == [1.0, 2.0, 3.0]
    assert (told, losses) == (["25213 poses were lost."] * 3, [])


def test_a_second_failure_ends_the_wait() -> None:
    unhomed = DeviceError(DeviceReason.NOT_HOMED, "Home it.")
    lasting = ReconnectingSource(Source([loss(), None, None, unhomed]))
    with pytest.raises(DeviceError, match="Home it"):
        lasting.read(1.0)


def test_a_present_device_may_not_be_silent_but_an_absent_one_may() -> None:
    lasting = ReconnectingSource(Source([None, loss(), None, None, pose(1.0)]))
    with pytest.raises(TimeoutError):
        lasting.read(1.0)
    # told to look only, it does not wait
    with pytest.raises(TimeoutError):
        lasting.read(0.0)
    assert lasting.read(1.0).time_s == 1.0


def test_patience_ends_with_the_loss() -> None:
    lasting = ReconnectingSource(Source([loss(), None, None]), patience_s=0.0)
    with pytest.raises(DeviceError, match="went away"):
        lasting.read(1.0)


def test_the_drivers_own_losses_are_survived() -> None:
    plug = Plug()
    story: list[str] = []
    with MicroScribe(plug.line.open_port(), replug=plug) as arm:

        def on_loss(_: DeviceError) -> None:
            story.append("lost")
            plug.move(is_in=True)

        lasting = ReconnectingSource(
            arm, math.inf, on_loss, on_return=lambda gap_s: story.append("back")
        )
        before = lasting.read(5.0)
        plug.move(is_in=False)
        # Poses that were measured before the plug was pulled come first.
        while "back" not in story:
            after = lasting.read(5.0)
        assert after.time_s > before.time_s
    assert story == ["lost", "back"]


class FallingSilent:
    """Poses that are there already, then silence."""

    def __init__(self, count: int) -> None:
        self._poses = [pose(i / 100) for i in range(count)]

    def read(self, timeout_s: float) -> Pose:
        if self._poses:
            return self._poses.pop(0)
        time.sleep(timeout_s)
        raise TimeoutError("silence")


def test_a_cancellable_source_passes_poses_in_order_and_silence_is_told() -> None:
    source = CancellableSource(FallingSilent(5), threading.Event())
    assert [source.read(1.0).time_s for _ in range(5)] == [i / 100 for i in range(5)]
    with pytest.raises(TimeoutError, match="silence"):
        source.read(0.0)
    with pytest.raises(TimeoutError, match="silence"):
        source.read(0.25)


def test_closing_ends_a_wait_for_a_silent_arm() -> None:
    closed = threading.Event()
    source = CancellableSource(FallingSilent(0), closed)
    threading.Timer(0.05, closed.set).start()
    # Without the event the wait would outlast the test's own limit.
    with pytest.raises(ClosedError):
        source.read(1e6)


class PoweredArm:
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


def test_poses_of_an_arm_with_power_pass() -> None:
    pose = Pose(1.0, 1.0, np.eye(4), 0)
    source = HomedSource(PoweredArm(HomeState.ASSUMED, [pose]))
    assert source.read(60.0) is pose


def test_an_arm_without_power_ends_the_wait_at_once() -> None:
    arm = PoweredArm(HomeState.UNKNOWN, [])
    with pytest.raises(DeviceError, match="begin again") as caught:
        HomedSource(arm).read(60.0)
    assert caught.value.reason is DeviceReason.NOT_HOMED
    assert len(arm.asked) == 1


def test_a_silent_arm_is_told_after_the_timeout() -> None:
    arm = PoweredArm(HomeState.HOMED, [])
    with pytest.raises(TimeoutError):
        HomedSource(arm).read(0.0)
    assert arm.asked == [0.0]
