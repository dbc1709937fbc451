import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.packet import (
    MotionReport,
    Reading,
    packet_length,
    standard_packet,
)
from devices.microscribe.kinematics.profiles import MICROSCRIBE_CODES
from devices.microscribe.wire.packets import Packet, PacketLayout, decode_packet

LENGTHS = """80:2 81:12 82:16 83:14 84:5 85:15 86:19 87:17 88:7 89:17 8A:21 8B:19
8C:11 8D:21 8E:25 8F:23 A0:4 A1:14 A2:18 A3:16 A4:7 A5:17 A6:21 A7:19 A8:9 A9:19 AA:23
AB:21 AC:13 AD:23 AE:27 AF:25"""

COUNTS = (13903, 6238, 6868, 4098, 3193, 8416, 300)
SIX = "6C 4F 30 5E 35 54 20 02 18 79 41 60"


@pytest.mark.parametrize("row", LENGTHS.split())
def test_lengths_are_those_of_the_table(row: str) -> None:
    header, length = int(row[:2], 16), int(row[3:])
    packet = standard_packet(header & 0x7F, Reading(COUNTS, 0), 0, MICROSCRIBE_CODES)
    assert packet[0] == header
    assert len(packet) == packet_length(header, MICROSCRIBE_CODES) == length
    assert PacketLayout(header & 0x7F).length == length


@pytest.mark.parametrize(
    ("sent", "buttons", "timer", "packet"),
    [
        (0x00, 1, None, "80 01"),
        (0x01, 0, None, "81 00 6C 4F 30 5E 35 54 20 02 18 79"),
        (0x03, 3, None, f"83 03 {SIX}"),
        (0x23, 1, 16383, f"A3 01 7F 7F {SIX}"),
        (0x02, 2, None, f"82 02 {SIX} 02 2C"),
        (0x27, 0, 900, f"A7 00 07 04 00 00 00 {SIX}"),
    ],
)
def test_worked_packets(
    sent: int, buttons: int, timer: int | None, packet: str
) -> None:
    made = standard_packet(
        sent, Reading(COUNTS, buttons), timer or 0, MICROSCRIBE_CODES
    )
    assert made == bytes.fromhex(packet)
    counts = COUNTS[: MICROSCRIBE_CODES[sent & 3]]
    assert decode_packet(made) == Packet(sent, buttons, timer, counts)


@given(
    st.integers(0, 0x3F),
    st.integers(0, 127),
    st.integers(0, 0x3FFF),
    st.tuples(*[st.integers(0, 0x3FFF)] * 7),
)
def test_the_drivers_own_reader_understands_every_packet(
    command: int, buttons: int, timer: int, counts: tuple[int, ...]
) -> None:
    packet = standard_packet(
        command, Reading(counts, buttons), timer, MICROSCRIBE_CODES
    )
    assert packet[0] == command | 0x80
    assert max(packet[1:]) < 0x80
    expected = counts[: MICROSCRIBE_CODES[command & 3]]
    told = timer if command & 0x20 else None
    assert decode_packet(packet) == Packet(command, buttons, told, expected)


START = Reading((100, 200, 300, 400, 500, 600), 0)


def report(buttons: int = 0, words: bytes = bytes(12)) -> MotionReport:
    arguments = bytes((0, 9, 0x23, buttons)) + bytes(8) + words
    return MotionReport(arguments, 0.0, START)


def test_delay_command_and_fixed_rate_are_read() -> None:
    fixed = report()
    assert (fixed.period_s, fixed.command, fixed.is_fixed_rate) == (0.01, 0x23, True)
    assert fixed.wants(START)


@given(st.integers(0, 5), st.integers(1, 200), st.integers(-8191, 8191))
def test_an_encoder_triggers_from_its_threshold_on(
    joint: int, limit: int, turned: int
) -> None:
    words = bytearray(12)
    words[2 * joint : 2 * joint + 2] = limit.to_bytes(2, "big")
    counts = list(START.counts)
    counts[joint] = (counts[joint] + turned) % 16384
    moved = Reading(tuple(counts), 0)
    assert report(words=bytes(words)).wants(moved) == (abs(turned) >= limit)
    # A joint whose threshold is zero never triggers.
    others = bytes(words[2:] + words[:2])
    assert not report(words=others).wants(moved)


@given(st.integers(1, 15), st.integers(0, 15))
def test_a_button_triggers_at_both_edges_if_its_bit_is_asked_for(
    mask: int, pressed: int
) -> None:
    down = Reading(START.counts, pressed)
    assert report(buttons=mask).wants(down) == bool(mask & pressed)
    held = MotionReport(report(buttons=mask).arguments, 0.0, down)
    assert held.wants(START) == bool(mask & pressed)
