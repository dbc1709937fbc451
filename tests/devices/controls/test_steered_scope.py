"""A scope steered by hand, by a clock that the test drives."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.controls.fulcrum import Fulcrum, FulcrumControl
from devices.controls.steered_scope import KEPT_S, STALL_S, SteeredArm
from devices.controls.steering import Axis, Steering, SteeringEvents
from devices.microscribe.emulator.in_memory import DrivenClock
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose

FULCRUM = Fulcrum(np.array((-6.3, -13.0, -6.5)), np.array((0.0, 0.86, 0.5)))


@dataclass
class Handset:
    """A device that is asked, fails when told to, and is let go of."""

    clock: DrivenClock
    fails_at_s: float = float("inf")
    polled: list[float] = field(default_factory=list)
    closed: int = 0

    def poll(self, steering: SteeringEvents) -> None:
        if self.clock.now() >= self.fails_at_s:
            raise DeviceError(DeviceReason.DISCONNECTED, "The pad went away.")
        self.polled.append(self.clock.now())

    def close(self) -> None:
        self.closed += 1


def scripted() -> Steering:
    steering = Steering()
    for at_s, axis, rate in (
        (50.005, Axis.INSERT, 1.0),
        (50.123, Axis.YAW, -0.5),
        (50.301, Axis.INSERT, 0.0),
        (50.302, Axis.ROLL, 1.0),
        (50.444, Axis.PITCH, 0.3),
    ):
        steering.hold(axis, rate, at_s)
    steering.press(1, True, 50.25)
    steering.press(1, False, 50.35)
    return steering


def flown(waits: list[float], until_s: float = 51.0) -> list[Pose]:
    clock = DrivenClock(50.0)
    arm = SteeredArm(FulcrumControl(FULCRUM), scripted(), clock=clock)
    poses: list[Pose] = []
    while clock.now() < until_s:
        # later is a stall
        wait = waits.pop() if waits else STALL_S
        clock.sleep_until(min(clock.now() + wait, until_s))
        poses += arm.drain()
    return poses


@given(st.lists(st.floats(0.0, 0.4), max_size=12))
@settings(deadline=None, max_examples=25)
def test_the_flight_does_not_depend_on_when_it_is_read(waits: list[float]) -> None:
    expected = flown([])
    got = flown(waits.copy())
    assert [p.time_s for p in got] == [p.time_s for p in expected]
    assert [p.host_time_s for p in got] == [p.host_time_s for p in expected]
    assert [p.buttons for p in got] == [p.buttons for p in expected]
    for a, b in zip(got, expected, strict=True):
        assert a.device_from_tip.tobytes() == b.device_from_tip.tobytes()


def test_poses_come_at_even_times_and_go_through_the_fulcrum() -> None:
    poses = flown([])
    assert [p.time_s for p in poses] == [(i + 1) / 100 for i in range(len(poses))]
    assert len(poses) == 100
    for pose in poses:
        arm = pose.tip_mm - FULCRUM.pivot_mm
        assert np.linalg.norm(np.cross(arm, pose.pointing)) < 1e-9
    assert {p.buttons for p in poses} == {0, 1}
    depth = (poses[-1].tip_mm - FULCRUM.pivot_mm) @ poses[-1].pointing
    assert depth == pytest.approx(25.0 * (50.301 - 50.005), abs=1e-6)


@given(
    st.floats(STALL_S + 0.02, 1000.0),
    st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(-1e3, 1e3)), max_size=8),
)
@settings(deadline=None, max_examples=25)
def test_a_stall_is_told_once_and_what_was_asked_for_meanwhile_is_not_done(
    stalled_s: float, turns: list[tuple[float, float]]
) -> None:
    """The flight's time stands; keys that are held go on, strokes are forgotten."""
    clock, steering = DrivenClock(50.0), Steering()
    arm = SteeredArm(FulcrumControl(FULCRUM), steering, clock=clock)
    before = arm.read(1.0)
    begun_s = clock.now()
    steering.hold(Axis.YAW, 1.0, begun_s + 0.01)
    steering.hold(Axis.YAW, 0.0, begun_s + 0.02)
    steering.press(1, True, begun_s + 0.02)
    blind_s = stalled_s - KEPT_S - 0.06
    for share, way in sorted(turns):
        steering.nudge(Axis.INSERT, way, begun_s + 0.03 + share * blind_s)
    clock.sleep(stalled_s)
    with pytest.raises(DeviceError, match="stood still") as caught:
        arm.read(1.0)
    assert caught.value.reason is DeviceReason.OVERRUN
    poses = [arm.read(1.0), *arm.drain()]
    assert len(poses) <= KEPT_S * 100 + 1
    assert poses[0].time_s == pytest.approx(before.time_s + 0.01)
    assert abs(poses[-1].host_time_s - clock.now()) < 0.011
    for pose in poses:
        assert pose.device_from_tip.tobytes() == before.device_from_tip.tobytes()
        assert pose.buttons == 1
    steering.nudge(Axis.INSERT, 0.1, clock.now())
    clock.sleep(0.05)
    moved = arm.drain()[-1].tip_mm - before.tip_mm
    assert np.linalg.norm(moved) == pytest.approx(0.1)


def test_reading_waits_for_the_next_tick() -> None:
    clock = DrivenClock(50.0)
    arm = SteeredArm(FulcrumControl(FULCRUM), Steering(), clock=clock)
    assert arm.latest() is None
    pose = arm.read(1.0)
    assert (pose.time_s, pose.host_time_s) == (0.01, 50.01)
    assert clock.now() == 50.01
    with pytest.raises(TimeoutError):
        arm.read(0.001)


def test_a_handset_is_asked_and_its_failure_comes_after_what_it_flew() -> None:
    clock = DrivenClock(50.0)
    pad = Handset(clock, fails_at_s=50.1)
    arm = SteeredArm(FulcrumControl(FULCRUM), Steering(), pad, clock=clock)
    clock.sleep_until(50.025)
    arm.latest()
    clock.sleep_until(50.2)
    assert [arm.read(1.0).time_s for _ in range(2)] == [0.01, 0.02]
    with pytest.raises(DeviceError, match="pad went away"):
        arm.read(1.0)
    arm.close()
    arm.close()
    assert pad.polled == [50.025]
    assert pad.closed == 2


def test_a_closed_arm_is_not_asked_any_more() -> None:
    clock = DrivenClock(50.0)
    pad = Handset(clock)
    with SteeredArm(FulcrumControl(FULCRUM), Steering(), pad, clock=clock) as arm:
        arm.read(1.0)
    clock.sleep(1.0)
    asked = len(pad.polled)
    with pytest.raises(EOFError):
        arm.read(1.0)
    assert len(pad.polled) == asked
    with pytest.raises(ValueError, match="rate_hz"):
        SteeredArm(FulcrumControl(FULCRUM), Steering(), rate_hz=0.0)
