"""The search for an arm harms none, whatever the arm was in the middle of."""

import random
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest

from devices.microscribe.driver.supervisor import ArmSettings
from devices.microscribe.emulator.emulated_arm import ArmTraits, EmulatedArm
from devices.microscribe.emulator.firmware import FirmwareState
from devices.microscribe.emulator.in_memory import MemoryLine
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.wire.link import ArmLink
from devices.microscribe.wire.sign_on import RATES
from devices.port import DeviceError
from tests.devices.microscribe.rare_faults import EVERY_FAULT, leave_session

Rehearse = Callable[..., Any]

SERIAL = DX40937.identity.serial.encode()

# What a host may have said before it died, with the session open. A motion command with
# seven encoders takes two arguments more.
HALF_SAID = {
    "nothing": b"",
    **{f"CF {n}": b"\xcf" + bytes(n) for n in range(24)},
    **{f"CF seven {n}": b"\xcf\0\x09\x22" + bytes(n) for n in range(23)},
    "stream": b"\xcf\0\x09\x23" + bytes(21),
    "C4": b"\xc4",
    "D2": b"\xd2",
    **{f"{code:02X}": bytes((code,)) for code in (0xC3, 0xC7, 0xD0, 0xD1)},
    "half a number": b"\xc7" + SERIAL[:4],
    "a whole number": b"\xc7" + SERIAL,
    "a wrong number": b"\xc3123",
    **{f"C3 {n}": b"\xc3" + SERIAL + b"\0" + bytes(n) for n in range(14)},
    **{f"D0 {n}": b"\xd0" + SERIAL + b"\0" + bytes(n) for n in range(14)},
    **{f"C7 {n}": b"\xc7" + SERIAL + b"\0" + bytes(n) for n in range(36)},
}


def _left_by(said: bytes, rate: int = 115200) -> tuple[MemoryLine, StillMotion]:
    motion = StillMotion(DX40937)
    arm = EmulatedArm(
        DX40937, motion, traits=ArmTraits(rate=rate, accepts_memory_writes=True)
    )
    leave_session(arm.firmware, "RUN", 0.0)
    arm.hear(said, 0.0)
    return MemoryLine(arm), motion


@pytest.mark.parametrize("said", HALF_SAID.values(), ids=list(HALF_SAID))
def test_no_home_is_set_and_no_memory_asked_for_from_any_state(said: bytes) -> None:
    line, motion = _left_by(said)
    before = line.arm.firmware.memory_writes
    link = ArmLink(line.open_port(), clock=line.clock)
    link.sign_on((115200,))
    assert line.arm.firmware.state is FirmwareState.IDLE
    assert line.arm.firmware.memory_writes == before
    assert motion.homed == 0
    # The first try already is understood.
    assert line.clock.now() < 0.2


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("name", ["nothing", "CF 0", "stream", "C7", "C3 0", "D2"])
def test_nor_at_any_other_rate(name: str, rate: int) -> None:
    line, motion = _left_by(HALF_SAID[name], rate)
    before = line.arm.firmware.memory_writes
    link = ArmLink(line.open_port(), clock=line.clock)
    link.sign_on(RATES)
    assert line.arm.firmware.state is FirmwareState.IDLE
    assert line.arm.firmware.memory_writes == before
    assert motion.homed == 0


def test_an_arm_sent_to_another_rate_by_half_a_command_is_found() -> None:
    line, _ = _left_by(b"\xc4", 19200)
    link = ArmLink(line.open_port(), clock=line.clock)
    link.sign_on(RATES)
    assert link.baud == line.arm.session_rate
    assert line.arm.firmware.state is FirmwareState.IDLE


def _all_faults() -> list[str]:
    return [
        f"{kind.word}={variant}" if variant else kind.word
        for kind in EVERY_FAULT
        for variant in (kind.variants or ("",))
    ]


@pytest.mark.parametrize("left", ["", "RUN", "MOTION", "ARGS", "PASSWORD"])
@pytest.mark.parametrize("fault", _all_faults())
def test_nor_under_any_fault(rehearse: Rehearse, fault: str, left: str) -> None:
    faults = [fault, *([f"f7={left}"] if left else [])]
    bench = rehearse(*faults, seed=random.Random(fault + left).randrange(1000))
    # Under many of them no session can open.
    with suppress(DeviceError):
        bench.connect(ArmSettings(rates=(115200,)))
    arm = bench.line.arm
    # One fault is somebody else who tries to, and power alone homes an arm.
    assert arm.firmware.memory_writes == arm.fired.get("f29_memory_write", 0)
    assert bench.motion.homed == arm.fired.get("f17_power_cycle", 0)


@pytest.mark.parametrize("ignored", range(1, 37))
def test_nor_by_a_stream_that_ignores_bytes(rehearse: Rehearse, ignored: int) -> None:
    bench = rehearse("f7=MOTION", f"f26={ignored}")
    bench.connect()
    assert bench.line.arm.firmware.memory_writes == 0
    assert bench.motion.homed == 0
