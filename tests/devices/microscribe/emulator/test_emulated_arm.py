import itertools
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.microscribe.emulator.emulated_arm import ArmTraits, EmulatedArm
from devices.microscribe.emulator.emulated_line import RATES
from devices.microscribe.emulator.motion import AnglesMotion, StillMotion
from devices.microscribe.kinematics.profiles import DX40937, G2_UNHOMED
from tests.devices.microscribe.rare_faults import EVERY_FAULT, parse_any_fault

Connect = Callable[..., Any]


@pytest.mark.parametrize("baud", RATES)
def test_it_signs_on_at_each_of_its_rates_and_keeps_it(
    connect: Connect, baud: int
) -> None:
    client = connect(baud=baud)
    assert client.sign_on() == b"IMMCMSCR\0"
    assert client.arm.session_rate == baud
    for other in RATES:
        client.port.baudrate = other
        assert (client.ask(b"\x03")[:1] == b"\x83") == (other == baud)


@pytest.mark.parametrize("baud", [4800, 230400])
def test_it_does_not_sign_on_at_a_rate_that_it_lacks(
    connect: Connect, baud: int
) -> None:
    assert b"MSCR" not in connect(baud=baud).sign_on()


def test_a_dead_hosts_session_is_ended_at_its_rate_only(connect: Connect) -> None:
    client = connect(baud=19200)
    client.sign_on()
    client.port.baudrate = 115200
    assert b"MSCR" not in client.sign_on()
    client.port.baudrate = 19200
    assert client.sign_on() == b"\xc5IMMCMSCR\0"


def test_set_baud_is_echoed_at_the_old_rate_and_then_switches(connect: Connect) -> None:
    client = connect()
    client.sign_on()
    assert client.ask(b"\xc4\x11") == b"\xc4"
    assert client.arm.session_rate == client.port.baudrate / 6 == 19200
    client.port.baudrate = 19200
    assert client.ask(b"\x03")[:1] == b"\x83"


def test_a_line_without_rates_takes_what_it_was_given() -> None:
    arm = EmulatedArm(DX40937, StillMotion(DX40937), traits=ArmTraits(rate=9600))
    arm.hear(b"IMMC", 0.0, None)
    assert arm.speak(0.001, None) == b""
    assert arm.speak(1.0, None) == b"IMMC"
    with pytest.raises(ValueError, match="4800"):
        ArmTraits(rate=4800)


def test_the_home_button_makes_an_arm_measure(connect: Connect) -> None:
    client = connect(profile=G2_UNHOMED)
    assert client.sign_on() == b"IMMCMSCR\0"
    assert client.ask(b"\x03\xcb") == b"\xcbEMU00024\0"
    client.arm.press_home_button(client.now_s)
    assert client.ask(b"\x03")[:1] == b"\x83"
    client.arm.power_cycle(client.now_s)
    client.sign_on()
    assert client.ask(b"\x03") == b""


def test_pedals_are_held_and_let_go(connect: Connect) -> None:
    client = connect()
    client.sign_on()
    client.arm.hold_pedal(0, client.now_s + 0.01)
    client.arm.hold_pedal(1)
    # Each answer ends the wait of 0.08 s later than the pedal that is held for 0.01 s.
    assert [client.ask(b"\x00")[1] for _ in range(2)] == [3, 2]
    client.arm.hold_pedal(1, float("-inf"))
    assert client.ask(b"\x00")[1] == 0
    with pytest.raises(ValueError, match="bit"):
        client.arm.hold_pedal(7)


def test_a_report_sends_every_packet_at_its_time_however_late_one_looks(
    connect: Connect,
) -> None:
    client = connect(motion=AnglesMotion(DX40937, lambda t: [0.5 * t] * 6))
    client.sign_on()
    client.port.write(b"\xcf\x00\x09\x23" + bytes(21))
    assert client.port.read(1) == b"\xcf"
    client.passes(2.0)
    data = client.port.read(16 * 200)
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
        traits, still = ArmTraits(seed=seed), StillMotion(DX40937)
        arm = EmulatedArm(DX40937, still, faults=plans, traits=traits)
        out, now = b"", 0.0
        for data in (b"IMMC", b"BEGIN", b"\x23", *heard, b"\x23", b"\xc5IMMC"):
            arm.hear(data, now, 115200)
            now += 0.03
            out += arm.speak(now, 115200)
        said.append((out, arm.fired))
    assert said[0] == said[1]
