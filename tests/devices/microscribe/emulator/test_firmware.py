import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.firmware import (
    ArmFirmware,
    FirmwareState,
    rate_of_code,
)
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937, HOME_COUNTS
from devices.microscribe.wire.packets import decode_packet


def _running(arm: StillMotion | None = None) -> ArmFirmware:
    firmware = ArmFirmware(DX40937, arm or StillMotion(DX40937), 0.0)
    assert firmware.receive(b"IMMC", 0.0) == b"IMMC"
    assert firmware.receive(b"BEGIN", 0.0) == b"MSCR\0"
    return firmware


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
        ("D2 07", "D2 07"),
        ("D2 55", "D2 55"),
        ("52 C5", "D2 C5"),
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
    firmware = _running()
    assert firmware.receive(bytes.fromhex(sent), 0.0) == bytes.fromhex(answer)


def test_timer_runs_at_900_ticks_and_wraps() -> None:
    firmware = _running()
    times = (0.0, 1.0, 18.0, 18.205, 40.0)
    timers = [decode_packet(firmware.receive(b"\x23", t)).timer for t in times]
    assert timers == [0, 900, 16200, 0, 36000 - 2 * 16384]


def test_begin_is_awaited_for_five_seconds() -> None:
    firmware = ArmFirmware(DX40937, StillMotion(DX40937), 0.0)
    firmware.receive(b"IMMC", 0.0)
    assert firmware.receive(b"BEGIN", 5.5) == b""
    assert firmware.state is FirmwareState.SYNC


def test_an_unfinished_command_is_dropped_after_a_second() -> None:
    firmware = _running()
    firmware.receive(b"\xcf\x00", 0.0)
    assert firmware.state is FirmwareState.ARGUMENTS
    assert firmware.receive(b"\x00", 1.5) == b"\x80\x00"


def test_calibration_memory_is_never_written() -> None:
    for code in (0xC3, 0xC7, 0xD0, 0xD1, 0x43):
        firmware = _running()
        answer = firmware.receive(bytes((code,)) + b"EMU00001\0", 0.0)
        assert answer == bytes((code | 0x80, 0))
        assert firmware.memory_writes == 1
        assert firmware.state is FirmwareState.IDLE


def test_threshold_report_waits_for_motion_and_pedals() -> None:
    arm = StillMotion(DX40937)
    firmware = _running(arm)
    command = b"\xcf\x00\x01\x03\x01" + bytes(8) + b"\x00\x05" + bytes(10)
    assert firmware.receive(command, 0.0) == b"\xcf"
    assert firmware.advance(0.01) == b""
    arm.counts = (HOME_COUNTS[0] + 4, *HOME_COUNTS[1:])
    assert firmware.advance(0.02) == b""
    arm.counts = (HOME_COUNTS[0] + 5, *HOME_COUNTS[1:])
    assert len(firmware.advance(0.03)) == 14
    assert firmware.advance(0.04) == b""
    arm.buttons = 1
    assert firmware.advance(0.05)[:2] == b"\x83\x01"
    arm.buttons = 0
    assert firmware.advance(0.06)[:2] == b"\x83\x00"


@given(st.lists(st.binary(max_size=40), max_size=6))
def test_nothing_heard_raises_and_sign_on_always_works_again(
    heard: list[bytes],
) -> None:
    firmware = ArmFirmware(DX40937, StillMotion(DX40937), 0.0)
    now = 0.0
    for data in heard:
        firmware.receive(data, now)
        now += 0.3
    # What a host does: finish what a dead one began, end its session, sign on.
    firmware.receive(bytes(26), now)
    answer = firmware.receive(b"\xc5IMMC", now)
    assert answer.endswith(b"IMMC")
    assert firmware.receive(b"BEGIN", now) == b"MSCR\0"


@pytest.mark.parametrize("repeats", [1, 4, 6])
def test_the_first_echo_may_want_several_attentions(repeats: int) -> None:
    firmware = ArmFirmware(DX40937, StillMotion(DX40937), 0.0, sync_repeats=repeats)
    heard = [firmware.receive(b"\xc5IMMC", 0.0) for _ in range(repeats + 2)]
    assert heard == [b""] * (repeats - 1) + [b"IMMC"] * 3
    with pytest.raises(ValueError, match="sync_repeats"):
        ArmFirmware(DX40937, StillMotion(DX40937), 0.0, sync_repeats=0)


def test_letters_split_by_noise_are_no_attention() -> None:
    firmware = ArmFirmware(DX40937, StillMotion(DX40937), 0.0)
    assert firmware.receive(b"IMM\xc5CIIMMC", 0.0) == b"IMMC"
    # Its last letter begins the next one only if it is an I.
    assert firmware.receive(b"MMC", 0.0) == b""


def test_the_end_in_a_session_leaves_the_rest_of_the_word_to_the_listener() -> None:
    firmware = _running()
    assert firmware.receive(b"END", 0.0) == b"\xc5"
    assert firmware.state is FirmwareState.SYNC
    assert firmware.receive(b"\xc5\x45\x03\x00", 0.0) == b""


def test_begin_in_an_open_session_homes_the_arm_and_ends_the_session() -> None:
    arm = StillMotion(DX40937, (1, 2, 3, 4, 5, 6))
    firmware = _running(arm)
    assert firmware.receive(b"BEGIN", 0.0) == b"\xc2\xc5"
    assert arm.counts == HOME_COUNTS
    assert firmware.state is FirmwareState.SYNC


def test_attention_in_an_open_session_ends_waiting_for_a_password() -> None:
    firmware = _running()
    firmware.receive(b"IMMC", 0.0)
    assert firmware.state is FirmwareState.PASSWORD
    # The END of a new host is swallowed; its zero is what frees the arm.
    assert firmware.receive(b"\xc5IMMC", 0.1) == b""
    assert firmware.receive(b"\x00", 0.2) == b"\x00"
    assert firmware.receive(b"\xc5IMMC", 0.3) == b"\xc5IMMC"


def test_a_motion_command_left_half_sent_swallows_the_end_but_not_for_long() -> None:
    firmware = _running()
    firmware.receive(b"\xcf\x00\x09", 0.0)
    assert firmware.receive(b"\xc5IMMC", 0.5) == b""
    assert firmware.receive(bytes(26), 0.6)[:1] == b"\xcf"
    assert firmware.receive(b"\xc5IMMC", 0.7).endswith(b"\xc5IMMC")


@pytest.mark.parametrize(
    ("code", "rate"),
    [
        *((0x00, 115200), (0x01, 57600), (0x02, 28800), (0x03, 14400)),
        *((0x10, 38400), (0x11, 19200), (0x12, 9600), (0x30, 8862), (0xC8, 115200)),
    ],
)
def test_rate_codes(code: int, rate: int) -> None:
    firmware = _running()
    assert firmware.receive(bytes((0xC4, code)), 0.0) == b"\xc4"
    assert firmware.asked_rate == rate


def test_there_are_twenty_six_rates() -> None:
    assert len({rate_of_code(code) for code in range(256)}) == 26


def test_a_granted_memory_write_is_kept_until_the_power_goes() -> None:
    firmware = ArmFirmware(
        DX40937, StillMotion(DX40937), 0.0, accepts_memory_writes=True
    )
    firmware.receive(b"IMMCBEGIN", 0.0)
    assert firmware.receive(b"\xc7wrong\0", 0.0) == b"\xc7\x00"
    block = bytes(range(100, 136))
    assert firmware.receive(b"\xc7EMU00001\0" + block, 0.0) == b"\xc7\xff"
    assert firmware.receive(b"\xc0", 0.0) == b"\xc0\x24" + block
    assert firmware.receive(b"\xd1EMU00001\0\x00", 0.0) == b"\xd1\xff\x80\x00"
    assert firmware.memory_writes == 3
    firmware.power_on(1.0)
    firmware.receive(b"IMMCBEGIN", 1.0)
    assert firmware.receive(b"\xc0", 1.0) != b"\xc0\x24" + block


@given(st.integers(0, 60), st.sampled_from((0x01, 0x03, 0x23, 0x02, 0x2F)))
def test_a_fixed_rate_report_is_never_denser_than_the_line(
    ticks: int, command: int
) -> None:
    firmware = _running()
    head = bytes((0xCF, 0, ticks, command))
    firmware.receive(head + bytes(23 if command & 3 == 2 else 21), 0.0)
    length = len(encoded := firmware.advance(0.0))
    assert encoded[0] == command | 0x80
    times: list[float] = []
    while len(times) < 20:
        due = firmware.next_s()
        assert due is not None
        times.append(due)
        firmware.advance(due)
    steps = [b - a for a, b in itertools.pairwise(times)]
    expected = max(ticks / 900.0, length * 10.0 / 115200)
    assert steps == pytest.approx([expected] * len(steps))


def test_a_marker_shows_where_a_stream_ended() -> None:
    firmware = _running()
    firmware.receive(b"\xcf\x00\x09\x03" + bytes(21), 0.0)
    firmware.advance(0.0)
    assert firmware.receive(b"\xd2\x55", 0.001) == b"\xd2\x55"
    assert firmware.state is FirmwareState.IDLE
