from collections.abc import Callable
from typing import Any

import pytest

from devices.microscribe.driver.sampler import HomeState
from devices.microscribe.emulator.firmware import ArmFirmware
from devices.microscribe.kinematics.profiles import SECOND_3DX
from devices.microscribe.wire.commands import ALLOWED, CLEAR_BYTES
from devices.port import DeviceError, DeviceReason

Rehearse = Callable[..., Any]


def test_a_short_interruption_is_bridged_by_a_ping(rehearse: Rehearse) -> None:
    bench = rehearse("f1@1+0.25")
    supervisor = bench.connect()
    bench.run(supervisor, 1.0)
    assert bench.run(supervisor, 1.0)
    sampler = supervisor.sampler
    assert (sampler.missed, sampler.recoveries) == (2, 1)
    assert sampler.home_state is HomeState.ASSUMED
    assert b"BEGIN" not in bench.written[bench.written.index(b"\x23") :]


def test_every_write_of_a_session_with_troubles_is_a_known_command(
    rehearse: Rehearse,
) -> None:
    """Somebody ends the arm's session, and later it falls silent for good."""
    bench = rehearse("f1@3")
    supervisor = bench.connect()
    bench.run(supervisor, 0.5)
    supervisor.home()
    arm = bench.line.arm
    arm.firmware.answers(b"\xc5", bench.line.clock.now())
    assert len(bench.run(supervisor, 1.5)) > 50, "the session was opened anew"
    assert supervisor.sampler.home_state is HomeState.HOMED
    with pytest.raises(DeviceError):
        bench.run(supervisor, 5.0)
    said = set(bench.written)
    assert said <= set(ALLOWED)
    assert {b"\xc5IMMC", b"BEGIN", b"\xc2", b"\x23", b"\x00", CLEAR_BYTES} <= said
    assert arm.firmware.memory_writes == 0


def test_another_arm_on_the_same_line_is_refused(rehearse: Rehearse) -> None:
    bench = rehearse()
    supervisor = bench.connect()
    bench.run(supervisor, 0.5)
    arm = bench.line.arm
    arm.firmware = ArmFirmware(SECOND_3DX, arm, bench.line.clock.now())
    with pytest.raises(DeviceError) as caught:
        bench.run(supervisor, 5.0)
    assert caught.value.reason is DeviceReason.WRONG_DEVICE
