from collections.abc import Callable
from typing import Any

import pytest

from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937

Connect = Callable[..., Any]
STREAM = b"\xcf\x00\x09\x23" + bytes(21)
ELSEWHERE = (1, 2, 3, 4, 5, 8416)


def timer(packet: bytes) -> int:
    return packet[2] << 7 | packet[3]


def test_f17_a_power_cycle_far_from_the_rest_pose(
    connect: Connect, clean: bytes
) -> None:
    client = connect("f17_power_cycle@1", motion=StillMotion(DX40937, ELSEWHERE))
    client.sign_on()
    for _ in range(5):
        packet = client.ask(b"\x23", 0.19)
        assert packet[4:6] == b"\x00\x01"
    client.passes(0.2)
    assert client.ask(b"\x23") == b"", "the session is gone"
    assert client.sign_on() == b"IMMCMSCR\0"
    packet = client.ask(b"\x23")
    assert packet[4:] == clean[2:], "the counts of the rest pose"
    assert timer(packet) < 0.5 * 900


def test_f19_the_timer_wraps_a_second_later(connect: Connect) -> None:
    client = connect("f19_timer_wrap")
    client.sign_on()
    times = []
    for _ in range(40):
        begun = client.now_s
        times.append((begun, timer(client.ask(b"\x23", 0.05))))
    before = [ticks for at, ticks in times if at < 0.99]
    after = [ticks for at, ticks in times if at > 1.01]
    assert min(before) > 16384 - 900 - 1
    assert max(after) < 1000


def test_f19_a_pause_of_twenty_seconds(connect: Connect, clean: bytes) -> None:
    client = connect("f19=pause@1")
    client.sign_on()
    first = client.ask(b"\x23")
    client.passes(1.0)
    for _ in range(19):
        assert client.ask(b"\x03", 1.0) == b""
    client.passes(1.0)
    second = client.ask(b"\x23")
    assert second[4:] == clean[2:]
    # More than a wrap lies between: 18.204 s.
    assert (timer(second) - timer(first)) % 16384 == pytest.approx(
        21.08 * 900 - 16384, abs=20
    )


def test_f24_questions_only_until_the_home_button(
    connect: Connect, clean: bytes
) -> None:
    client = connect("f24_unhomed")
    assert client.sign_on() == b"IMMCMSCR\0"
    assert client.ask(b"\xcb") == b"\xcbEMU00001\0"
    assert client.poll(3) == [b""] * 3
    assert client.ask(STREAM) == b"\xcf"
    client.ask(b"\x00")
    client.arm.press_home_button(client.now_s)
    assert client.poll() == [clean]


@pytest.mark.parametrize("ignored", [1, 3])
def test_f26_a_stream_ignores_the_first_commands(
    connect: Connect, ignored: int
) -> None:
    client = connect(f"f26_stream_goes_on={ignored}")
    client.sign_on()
    assert client.ask(STREAM)[:2] == b"\xcf\xa3"
    for _ in range(ignored):
        assert b"\xa3" in client.ask(b"\x00", 0.1)
    client.ask(b"\x00", 0.1)
    assert client.ask(b"\xcb") == b"\xcbEMU00001\0"


def test_f28_the_host_hears_itself_and_the_arm_hears_nothing(connect: Connect) -> None:
    client = connect("f28_loopback")
    assert client.ask(b"\xc5IMMC") == b"\xc5IMMC"
    assert client.ask(b"BEGIN") == b"BEGIN"
    assert client.arm.packets == 0
    assert client.arm.far_end.state.name == "SYNC"


def test_f29_a_stranger_writes_to_the_memory_and_is_refused(
    connect: Connect, clean: bytes
) -> None:
    client = connect("f29_memory_write@packet:3")
    client.sign_on()
    before = client.ask(b"\xc0")
    packets = client.poll(4)
    assert client.arm.far_end.memory_writes == 1
    # The echo and the refusal reach the host, who never asked.
    assert b"".join(packets) == clean * 3 + b"\xc7\x00" + clean
    assert client.ask(b"\xc0") == before
    assert client.arm.fired == {"f29_memory_write": 1}
