from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator_state import FarEnd, FarState
from devices.microscribe.packets import decode_packet
from devices.microscribe.profiles import DX40937, HOME_COUNTS


@dataclass
class _Arm:
    counts: tuple[int, ...] = HOME_COUNTS
    buttons: int = 0

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        return self.counts, self.buttons

    def home(self) -> None:
        self.counts = HOME_COUNTS


def _running(arm: _Arm | None = None) -> FarEnd:
    far_end = FarEnd(DX40937, arm or _Arm(), 0.0)
    assert far_end.receive(b"IMMC", 0.0) == b"IMMC"
    assert far_end.receive(b"BEGIN", 0.0) == b"MSCR\0"
    return far_end


@pytest.mark.parametrize(
    ("sent", "answer"),
    [
        ("00", "80 00"),
        ("83", "83 00 6C 4F 30 5E 35 54 20 02 18 79 41 60"),
        ("03", "83 00 6C 4F 30 5E 35 54 20 02 18 79 41 60"),
        ("C9", "C9 4D 53 43 52 00"),
        ("49", "C9 4D 53 43 52 00"),
        ("D3", "D3 02 00 03"),
        ("C2", "C2"),
        ("D2 07", "07"),
        ("C4 00", "C4"),
        ("D9", ""),
        (
            "C6",
            "C6 03 3F FF 00 00 00 00 00 00 00 00 00 3F FF 3F FF 1F FF 0F FF 0F FF "
            "00 00",
        ),
        (
            "C0",
            "C0 24 00 00 3F F5 FF F9 3F E5 C0 02 C0 0C 00 00 03 C0 28 10 02 15 FE 6F "
            "01 8F 20 6C FC 92 FF FD 24 1C 01 40 EB 66",
        ),
        # Letters of a sign-on in an open session are commands.
        ("42 45 47 49 4E", "C2 C5"),
        (
            "49 4D 4D 43",
            "C9 4D 53 43 52 00"
            + " CD 46 6F 72 6D 61 74 20 44 48 30 2E 35 00" * 2
            + " C3",
        ),
    ],
)
def test_answers_to_the_byte(sent: str, answer: str) -> None:
    far_end = _running()
    assert far_end.receive(bytes.fromhex(sent), 0.0) == bytes.fromhex(answer)


def test_timer_runs_at_900_ticks_and_wraps() -> None:
    far_end = _running()
    times = (0.0, 1.0, 18.0, 18.205, 40.0)
    timers = [decode_packet(far_end.receive(b"\x23", t)).timer for t in times]
    assert timers == [0, 900, 16200, 0, 36000 - 2 * 16384]


def test_begin_is_awaited_for_five_seconds() -> None:
    far_end = FarEnd(DX40937, _Arm(), 0.0)
    far_end.receive(b"IMMC", 0.0)
    assert far_end.receive(b"BEGIN", 5.5) == b""
    assert far_end.state is FarState.SYNC


def test_an_unfinished_command_is_dropped_after_a_second() -> None:
    far_end = _running()
    far_end.receive(b"\xcf\x00", 0.0)
    assert far_end.state is FarState.ARGUMENTS
    assert far_end.receive(b"\x00", 1.5) == b"\x80\x00"


def test_calibration_memory_is_never_written() -> None:
    for code in (0xC3, 0xC7, 0xD0, 0xD1, 0x43):
        far_end = _running()
        answer = far_end.receive(bytes((code,)) + b"EMU00001\0", 0.0)
        assert answer == bytes((code | 0x80, 0))
        assert far_end.memory_writes == 1
        assert far_end.state is FarState.IDLE


def test_fixed_rate_report_and_its_end() -> None:
    far_end = _running()
    assert far_end.receive(b"\xcf\x00\x09\x23" + bytes(21), 0.0) == b"\xcf"
    got = b"".join(far_end.advance(0.001 * i) for i in range(100))
    assert len(got) == 10 * 16
    assert far_end.receive(b"\x00", 0.0995) == b"\x80\x00"
    assert far_end.advance(1.0) == b""


def test_threshold_report_waits_for_motion_and_pedals() -> None:
    arm = _Arm()
    far_end = _running(arm)
    command = b"\xcf\x00\x01\x03\x01" + bytes(8) + b"\x00\x05" + bytes(10)
    assert far_end.receive(command, 0.0) == b"\xcf"
    assert far_end.advance(0.01) == b""
    arm.counts = (HOME_COUNTS[0] + 4, *HOME_COUNTS[1:])
    assert far_end.advance(0.02) == b""
    arm.counts = (HOME_COUNTS[0] + 5, *HOME_COUNTS[1:])
    assert len(far_end.advance(0.03)) == 14
    assert far_end.advance(0.04) == b""
    arm.buttons = 1
    assert far_end.advance(0.05)[:2] == b"\x83\x01"
    arm.buttons = 0
    assert far_end.advance(0.06)[:2] == b"\x83\x00"


def test_seven_encoders_want_two_more_arguments() -> None:
    far_end = _running()
    assert far_end.receive(b"\xcf\x00\x09\x02" + bytes(21), 0.0) == b""
    assert far_end.receive(bytes(2), 0.0) == b"\xcf"


@given(st.lists(st.binary(max_size=40), max_size=6))
def test_nothing_heard_raises_and_sign_on_always_works_again(
    heard: list[bytes],
) -> None:
    far_end = FarEnd(DX40937, _Arm(), 0.0)
    now = 0.0
    for data in heard:
        far_end.receive(data, now)
        now += 0.3
    # What a host does: finish what a dead one began, end its session, sign on.
    far_end.receive(bytes(26), now)
    answer = far_end.receive(b"\xc5IMMC", now)
    assert answer.endswith(b"IMMC")
    assert far_end.receive(b"BEGIN", now) == b"MSCR\0"
