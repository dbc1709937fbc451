import itertools
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.emulated_line import RATES
from devices.microscribe.emulator.in_memory import MemoryLine
from devices.microscribe.emulator.motion import AnglesMotion, StillMotion
from devices.microscribe.kinematics.profiles import (
    DX40937,
    G2_UNHOMED,
    ArmProfile,
)
from tests.devices.microscribe.rare_faults import (
    EVERY_FAULT,
    parse_any_fault,
)

ELSEWHERE = (1, 2, 3, 4, 5, 8416)


def arm_and_line(
    profile: ArmProfile = DX40937, **options: Any
) -> tuple[EmulatedArm, MemoryLine]:
    arm = EmulatedArm(profile, StillMotion(profile), **options)
    return arm, MemoryLine(arm)


def sign_on(line: MemoryLine, baud: int = 115200) -> bytes:
    port = line.open_serial(baud, timeout=0.1)
    port.write(b"\xc5IMMC")
    heard = port.read(5)
    port.write(b"BEGIN")
    return heard + port.read(9)


@pytest.mark.parametrize("baud", RATES)
def test_it_signs_on_at_each_of_its_rates_and_keeps_it(baud: int) -> None:
    arm, line = arm_and_line()
    assert sign_on(line, baud) == b"IMMCMSCR\0"
    assert arm.session_rate == baud
    for other in RATES:
        port = line.open_serial(other, timeout=0.05)
        port.write(b"\x03")
        assert (port.read(14)[:1] == b"\x83") == (other == baud)
        port.read(99)


@pytest.mark.parametrize("baud", [4800, 230400])
def test_it_does_not_sign_on_at_a_rate_that_it_lacks(baud: int) -> None:
    _, line = arm_and_line()
    assert b"MSCR" not in sign_on(line, baud)


def test_a_dead_hosts_session_is_ended_at_its_rate_only() -> None:
    _, line = arm_and_line()
    sign_on(line, 19200)
    assert b"MSCR" not in sign_on(line, 115200)
    assert sign_on(line, 19200) == b"\xc5IMMCMSCR\0"


def test_set_baud_is_echoed_at_the_old_rate_and_then_switches() -> None:
    arm, line = arm_and_line()
    sign_on(line)
    port = line.open_serial(timeout=0.05)
    port.write(b"\xc4\x11")
    assert port.read(2) == b"\xc4"
    assert arm.session_rate == 19200
    port.baudrate = 19200
    port.write(b"\x03")
    assert port.read(14)[:1] == b"\x83"


def test_a_line_without_rates_takes_what_it_was_given() -> None:
    arm = EmulatedArm(DX40937, StillMotion(DX40937), rate=9600)
    arm.hear(b"IMMC", 0.0, None)
    assert arm.speak(0.001, None) == b""
    assert arm.speak(1.0, None) == b"IMMC"
    with pytest.raises(ValueError, match="rate must be one of"):
        EmulatedArm(DX40937, StillMotion(DX40937), rate=4800)


def test_the_home_button_makes_an_arm_measure() -> None:
    arm, line = arm_and_line(G2_UNHOMED)
    assert sign_on(line) == b"IMMCMSCR\0"
    port = line.open_serial(timeout=0.05)
    port.write(b"\x03\xcb")
    assert port.read(99) == b"\xcbEMU00024\0"
    arm.press_home_button(line.clock.now())
    port.write(b"\x03")
    assert port.read(14)[:1] == b"\x83"
    arm.power_cycle(line.clock.now())
    sign_on(line)
    port.write(b"\x03")
    assert port.read(14) == b""


def test_pedals_are_held_and_let_go() -> None:
    arm, line = arm_and_line()
    sign_on(line)
    port = line.open_serial(timeout=0.05)

    def buttons() -> int:
        port.write(b"\x00")
        return port.read(2)[1]

    arm.hold_pedal(0, line.clock.now() + 0.01)
    arm.hold_pedal(1)
    assert buttons() == 3
    line.clock.sleep(0.02)
    assert buttons() == 2
    arm.hold_pedal(1, float("-inf"))
    assert buttons() == 0
    with pytest.raises(ValueError, match="bit"):
        arm.hold_pedal(7)


def test_a_report_sends_every_packet_at_its_time_however_late_one_looks() -> None:
    turning = AnglesMotion(DX40937, lambda t: [0.5 * t] * 6)
    arm = EmulatedArm(DX40937, turning)
    line = MemoryLine(arm)
    sign_on(line)
    port = line.open_serial(timeout=0.01)
    port.write(b"\xcf\x00\x09\x23" + bytes(21))
    assert port.read(1) == b"\xcf"
    line.clock.sleep(2.0)
    data = port.read(16 * 200)
    timers = [data[i + 2] << 7 | data[i + 3] for i in range(0, len(data), 16)]
    assert [b - a for a, b in itertools.pairwise(timers)] == [9] * 199
    base = [data[i + 4] << 7 | data[i + 5] for i in range(0, len(data), 16)]
    steps = {b - a for a, b in itertools.pairwise(base[1:])}
    assert steps <= {13, 14}, "0.005 rad of 16384 counts a turn"


NAMES = sorted(kind.name() for kind in EVERY_FAULT)
moments = st.sampled_from(("", "@0.05", "@p:0.3", "@packet:2", "@0.02+0.1"))


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from(NAMES), moments), min_size=1, max_size=4),
    st.lists(st.binary(max_size=30), max_size=8),
    st.integers(0, 9),
)
def test_no_faults_and_no_bytes_make_it_raise_and_seeds_repeat_it(
    faults: list[tuple[str, str]], heard: list[bytes], seed: int
) -> None:
    plans = [parse_any_fault(name + moment) for name, moment in faults]
    said = []
    for _ in range(2):
        arm = EmulatedArm(DX40937, StillMotion(DX40937), faults=plans, seed=seed)
        out, now = b"", 0.0
        for data in (b"IMMC", b"BEGIN", b"\x23", *heard, b"\x23", b"\xc5IMMC"):
            arm.hear(data, now, 115200)
            now += 0.03
            out += arm.speak(now, 115200)
        said.append((out, arm.fired))
    assert said[0] == said[1]
