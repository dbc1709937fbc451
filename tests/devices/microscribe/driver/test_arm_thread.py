import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from devices.microscribe import MicroScribe
from devices.microscribe.driver.sampler import HomeState, MotionReports
from devices.microscribe.driver.supervisor import Presence
from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.wire.line import LinkTiming
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose
from tests.devices.plugged_arm import Plug
from tests.slow_cases import slow

STREAM = MotionReports(period_ticks=9)
either_way = pytest.mark.parametrize("reports", [None, STREAM], ids=["poll", "stream"])


@pytest.fixture
def no_thread_stays() -> Iterator[None]:
    before = set(threading.enumerate())
    yield
    assert set(threading.enumerate()) == before


def _wait(until: Callable[[], object]) -> None:
    for _ in range(2000):
        if until():
            return
        time.sleep(0.005)
    raise AssertionError("it did not happen within ten seconds")


@either_way
def test_poses_come_fresh_and_in_order(
    no_thread_stays: None, reports: MotionReports | None
) -> None:
    plug = Plug()
    with MicroScribe(plug.line.open_port(), reports=reports) as arm:
        poses = [arm.read(5.0) for _ in range(30)]
        assert (np.diff([pose.time_s for pose in poses]) > 0.0).all()
        _wait(lambda: arm.pose_age_s() < 0.1)
        assert arm.counts == DX40937.home_counts
        assert arm.frozen_joints == ()
        assert abs(arm.clock_drift) <= 3e-4
        assert arm.presence is Presence.THERE


@either_way
def test_homing_is_possible_at_any_time(
    no_thread_stays: None, reports: MotionReports | None
) -> None:
    plug = Plug()
    with MicroScribe(plug.line.open_port(), reports=reports, assume_home=False) as arm:
        with pytest.raises(DeviceError, match="home it"):
            arm.read(0.2)
        arm.home()
        assert arm.home_state is HomeState.HOMED
        assert arm.read(5.0)
    assert plug.motion.homed == 1


@either_way
def test_a_pulled_plug_is_told_once_and_waited_out(
    no_thread_stays: None, reports: MotionReports | None
) -> None:
    plug = Plug()
    port = plug.line.open_port()
    with MicroScribe(port, reports=reports, replug=plug) as arm:
        last = arm.read(5.0)
        plug.move(False)
        poses: list[Pose] = [last]
        with pytest.raises(DeviceError) as caught:
            poses.extend(arm)
        assert caught.value.reason is DeviceReason.DISCONNECTED
        # The last pose stays, grows old and says so.
        last = poses[-1]
        assert arm.latest() is last
        _wait(lambda: arm.pose_age_s() > 0.1)
        with pytest.raises(TimeoutError, match=r"memory:1 in 0\.01 s; .*looked for"):
            arm.read(0.01)
        states = [arm.presence]
        assert arm.trouble is not None
        plug.move(True)
        assert arm.read(10.0).time_s > last.time_s
        states.append(arm.presence)
        assert states == [Presence.LOST, Presence.THERE]
        assert arm.counters["losses"] == 1
        assert arm.home_state is HomeState.ASSUMED


def _read_on(arm: MicroScribe, patience_s: float) -> None:
    while True:
        arm.read(patience_s)


@pytest.mark.parametrize("reports", [STREAM, *slow(None)])
@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        ("f1@0.3", "does not answer; check its power"),
        *slow(("garbage@0.3", "no packets")),
    ],
)
def test_a_silence_names_the_port_and_its_cause(
    no_thread_stays: None, reports: MotionReports | None, fault: str, cause: str
) -> None:
    plug = Plug(fault)
    with MicroScribe(plug.line.open_port(), reports=reports) as arm:
        with pytest.raises(TimeoutError, match=r"in (0\.[4-9]|[1-4])") as caught:
            _read_on(arm, 0.4)
        assert cause in str(caught.value)


def test_an_arm_that_is_lost_can_be_closed(no_thread_stays: None) -> None:
    plug = Plug()
    arm = MicroScribe(plug.line.open_port(), replug=plug)
    arm.read(5.0)
    plug.move(False)
    _wait(lambda: arm.presence is Presence.LOST)
    arm.close()
    with pytest.raises(EOFError, match="was closed"):
        arm.latest()


def test_where_nothing_answers_no_thread_is_left(no_thread_stays: None) -> None:
    hasty = LinkTiming(per_rate=0.02, forced_rate=0.05)
    plug = Plug("f1")
    port = plug.line.open_port()
    with pytest.raises(DeviceError) as caught:
        MicroScribe(port, timing=hasty)
    assert caught.value.reason is DeviceReason.NO_DEVICE
    with pytest.raises(DeviceError):
        port.write(b"\0")
