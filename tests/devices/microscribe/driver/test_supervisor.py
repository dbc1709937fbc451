from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from devices.microscribe.driver.sampler import HomeState, MotionReports
from devices.microscribe.driver.supervisor import (
    FIRST_RETRY_S,
    LONGEST_RETRY_S,
    ConnectionSupervisor,
    Presence,
)
from devices.microscribe.kinematics.profiles import SECOND_3DX
from devices.port import DeviceError, DeviceReason

Bench = Any
Rehearse = Callable[..., Bench]

STREAM = MotionReports(period_ticks=9)
either_way = pytest.mark.parametrize("reports", [None, STREAM], ids=["poll", "stream"])


def _attempts(
    bench: Bench, supervisor: ConnectionSupervisor, seconds: float
) -> list[float]:
    """When the arm was looked for."""
    clock = bench.line.clock
    until = clock.now() + seconds
    found = []
    while clock.now() < until:
        if supervisor.presence is Presence.LOST:
            found.append(clock.now())
        supervisor.step()
        clock.sleep_until(min(supervisor.due_s, until))
    return found


@either_way
def test_a_lost_arm_is_looked_for_less_and_less_often(
    rehearse: Rehearse, reports: MotionReports | None
) -> None:
    bench = rehearse(reports=reports)
    supervisor = bench.connect(replug=True)
    bench.run(supervisor, 0.2)
    bench.line.arm.unplug(bench.line.clock.now())
    pauses = np.diff(_attempts(bench, supervisor, 60.0))
    expected = [2.0 * FIRST_RETRY_S, 2.0, 4.0, 8.0, *[LONGEST_RETRY_S] * 4]
    assert pauses == pytest.approx(expected[: len(pauses)], abs=1e-6)
    assert supervisor.trouble is not None
    assert supervisor.losses == 1


@either_way
def test_a_replugged_arm_goes_on_at_its_new_port(
    rehearse: Rehearse, reports: MotionReports | None
) -> None:
    bench = rehearse(reports=reports)
    supervisor = bench.connect(replug=True)
    before = bench.run(supervisor, 1.0)
    bench.line.arm.unplug(bench.line.clock.now())
    assert bench.run(supervisor, 3.0) == []
    bench.line.arm.replug(bench.line.clock.now())
    after = bench.run(supervisor, 10.0)
    assert supervisor.presence is Presence.THERE
    assert supervisor.port.name == "memory:2"
    # It kept its power, so its counts are what they were.
    assert supervisor.sampler.home_state is HomeState.ASSUMED
    bench.steady(before + after)
    assert bench.opened[0].closed
    assert supervisor.link.session.counters.packets > len(before)


@either_way
def test_an_arm_that_lost_its_power_meanwhile_is_not_trusted(
    rehearse: Rehearse, reports: MotionReports | None
) -> None:
    bench = rehearse(reports=reports)
    supervisor = bench.connect(replug=True)
    bench.run(supervisor, 1.0)
    bench.line.arm.unplug(bench.line.clock.now())
    bench.run(supervisor, 2.0)
    bench.line.arm.power_cycle(bench.line.clock.now())
    bench.line.arm.replug(bench.line.clock.now())
    assert bench.run(supervisor, 10.0) == []
    assert supervisor.presence is Presence.THERE
    states = [supervisor.sampler.home_state]
    assert supervisor.home()
    states.append(supervisor.sampler.home_state)
    assert states == [HomeState.UNKNOWN, HomeState.HOMED]
    assert bench.run(supervisor, 1.0)


def test_silence_at_an_open_port_counts_as_a_power_cut(rehearse: Rehearse) -> None:
    """Whatever its timer says by chance when it answers again."""
    bench = rehearse()
    supervisor = bench.connect(replug=True)
    bench.run(supervisor, 1.0)
    bench.line.arm.power_off(bench.line.clock.now())
    bench.run(supervisor, 8.0)
    states = [supervisor.presence]
    bench.line.arm.power_on(bench.line.clock.now())
    bench.run(supervisor, 20.0)
    states.append(supervisor.presence)
    assert states == [Presence.LOST, Presence.THERE]
    assert supervisor.sampler.home_state is HomeState.UNKNOWN


def test_another_arm_at_the_port_is_left_alone(rehearse: Rehearse) -> None:
    bench = rehearse()
    supervisor = bench.connect(replug=True)
    bench.run(supervisor, 0.5)
    arm, other = bench.line.arm, rehearse(profile=SECOND_3DX).line.arm
    arm.unplug(bench.line.clock.now())
    bench.run(supervisor, 0.1)
    other.generation = 2
    bench.line.arm = other
    assert bench.run(supervisor, 8.0) == []
    assert supervisor.presence is Presence.LOST
    assert supervisor.trouble is not None
    assert supervisor.trouble.reason is DeviceReason.WRONG_DEVICE
    assert "EMU00002" in str(supervisor.trouble)
    assert bench.written[-1] == b"\xc5"
    assert all(port.closed for port in bench.opened)


def test_without_a_finder_a_loss_is_an_error(rehearse: Rehearse) -> None:
    bench = rehearse()
    supervisor = bench.connect()
    bench.run(supervisor, 0.5)
    bench.line.arm.unplug(bench.line.clock.now())
    with pytest.raises(DeviceError) as caught:
        bench.run(supervisor, 0.1)
    assert caught.value.reason is DeviceReason.DISCONNECTED


def test_ports_that_were_there_before_are_not_spoken_to(rehearse: Rehearse) -> None:
    bench = rehearse()
    supervisor = bench.connect(replug=True)
    bench.run(supervisor, 0.2)
    asked: list[str] = []

    class Finder:
        def names(self) -> list[str]:
            return ["printer", *(["new"] if supervisor.losses and asked else [])]

        def open(self, name: str) -> Any:
            asked.append(name)
            raise DeviceError(DeviceReason.NO_PORT, f"There is no {name}.")

    supervisor._finder = Finder()
    bench.line.arm.unplug(bench.line.clock.now())
    _attempts(bench, supervisor, 5.0)
    assert set(asked) == {"memory:1", "new"}


@pytest.mark.slow
def test_a_soak_of_ten_minutes_loses_nothing(rehearse: Rehearse) -> None:
    """Thirty-three wraps of the timer; the clock is driven, at a tenth of the rate."""
    bench = rehearse(reports=MotionReports(period_ticks=15))
    supervisor = bench.connect()
    poses = bench.run(supervisor, 600.0)
    bench.steady(poses)
    steps = np.round(np.diff([pose.time_s for pose in poses]) * 900.0)
    assert set(steps) <= {14.0, 15.0, 16.0}
    assert len(poses) == pytest.approx(600 * 60, abs=60)
    seen = supervisor.link.session
    assert (seen.counters.framing, seen.counters.noise, seen.stray) == (0, 0, 0)
    assert supervisor.sampler.missed == 0
