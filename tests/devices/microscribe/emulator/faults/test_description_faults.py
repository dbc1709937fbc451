from collections.abc import Callable
from typing import Any

import pytest

from devices.microscribe.emulator.motion import AnglesMotion
from devices.microscribe.kinematics.profiles import DX40937, STANDARD

Connect = Callable[..., Any]


@pytest.mark.parametrize(
    ("fault", "answer"),
    [
        ("f20_bad_string", b"\xc8MicroScribe3D"),
        ("f20=long", b"\xc8MicroScribe3D" + b"x" * 27 + b"\0"),
        ("f20=non_ascii", b"\xc8\xe9icroScribe3D\0"),
        ("f20=empty", b"\xc8\0"),
    ],
)
def test_f20_a_string_breaks_a_rule_once(
    connect: Connect, fault: str, answer: bytes
) -> None:
    client = connect(fault)
    client.sign_on()
    assert client.ask(b"\xc8") == answer
    assert client.ask(b"\xc8") == b"\xc8MicroScribe3D\0"


def test_f20_counts_strings(connect: Connect) -> None:
    client = connect("f20=empty@packet:4")
    client.sign_on()
    answers = [client.ask(bytes((code,))) for code in range(0xC8, 0xCF)]
    assert [len(answer) == 2 for answer in answers] == [False] * 3 + [True] + [
        False
    ] * 3


@pytest.mark.parametrize("length", [0, 35, 37, 255])
def test_f21_a_block_of_another_length(connect: Connect, length: int) -> None:
    clean = connect()
    clean.sign_on()
    whole = clean.ask(b"\xc0")[2:]
    client = connect(f"f21_bad_parameters={length}")
    client.sign_on()
    for _ in range(2):
        answer = client.ask(b"\xc0")
        assert answer[:2] == bytes((0xC0, length))
        assert answer[2:] == (whole + bytes(255))[:length]
    assert client.ask(b"\xcd") == b"\xcdFormat DH0.5\0"


def test_f21_an_unknown_format(connect: Connect) -> None:
    client = connect("f21=format")
    client.sign_on()
    assert client.ask(b"\xcd") == b"\xcdFormat DH9.9\0"
    assert client.ask(b"\xcb") == b"\xcbEMU00001\0"
    assert len(client.ask(b"\xc0")) == 38


def test_f22_maxima_all_zero(connect: Connect) -> None:
    client = connect("f22_bad_maxima")
    client.sign_on()
    assert client.ask(b"\xc6") == b"\xc6" + bytes(24)


def test_f22_encoders_that_are_no_power_of_two_are_what_the_arm_then_has(
    connect: Connect,
) -> None:
    client = connect("f22=odd")
    client.sign_on()
    words = client.ask(b"\xc6")[13:]
    maxima = [words[i] << 8 | words[i + 1] for i in range(0, 12, 2)]
    assert maxima == [15999, 15999, 7999, 3999, 3999, 0]
    assert client.arm.profile.encoders.turn[:2] == (16000, 16000)
    # A quarter of a turn is a quarter of the new counts.
    motion = AnglesMotion(client.arm.profile, lambda t: [1.5707963267948966] * 6)
    assert motion.latch(0.0)[0][:5] == (4000, 4000, 2000, 1000, 1000)


@pytest.mark.parametrize(
    ("fault", "comment"),
    [("f23", b"Standard+Beta"), ("f23=standard", b"Standard")],
)
def test_f23_the_second_elbow_angle_is_kept_silent(
    connect: Connect, fault: str, comment: bytes
) -> None:
    for profile in (DX40937, STANDARD):
        client = connect(fault, profile=profile)
        client.sign_on()
        assert client.ask(b"\xcc") == b"\xcc" + comment + b"\0"
        assert client.ask(b"\xd3") == b""
        assert client.ask(b"\x00") == b"\x80\x00", "the session goes on"
