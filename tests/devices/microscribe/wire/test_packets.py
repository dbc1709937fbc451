import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.wire.packets import Layout, Packet, decode_packet
from tests.devices.microscribe.drawn_packets import encode_packet, packets

COUNTS = (13903, 6238, 6868, 4098, 3193, 8416, 300)
SIX = "6C 4F 30 5E 35 54 20 02 18 79 41 60"

# (bytes, buttons, timer, analog, encoders) of packets worked out by hand.
WORKED = [
    ("80 01", 1, None, (), 0),
    ("81 00 6C 4F 30 5E 35 54 20 02 18 79", 0, None, (), 5),
    ("83 03 " + SIX, 3, None, (), 6),
    ("A3 01 7F 7F " + SIX, 1, 16383, (), 6),
    ("82 02 " + SIX + " 02 2C", 2, None, (), 7),
    ("A7 00 07 04 7F 40 40 " + SIX, 0, 900, (255, 128), 6),
    (
        "AF 00 00 01 7F 7F 00 00 3F 40 01 7F 55 " + SIX,
        0,
        1,
        (255, 254, 1, 0, 127, 128, 3, 254),
        6,
    ),
]

# Header -> bytes of its packet, as the vendor's manual tables them.
LENGTHS = {
    **{0x80: 2, 0x81: 12, 0x82: 16, 0x83: 14, 0x84: 5, 0x85: 15, 0x86: 19, 0x87: 17},
    **{0x88: 7, 0x89: 17, 0x8A: 21, 0x8B: 19, 0x8C: 11, 0x8D: 21, 0x8E: 25, 0x8F: 23},
    **{0xA0: 4, 0xA1: 14, 0xA2: 18, 0xA3: 16, 0xA4: 7, 0xA5: 17, 0xA6: 21, 0xA7: 19},
    **{0xA8: 9, 0xA9: 19, 0xAA: 23, 0xAB: 21, 0xAC: 13, 0xAD: 23, 0xAE: 27, 0xAF: 25},
}


@pytest.mark.parametrize(("text", "buttons", "timer", "analog", "encoders"), WORKED)
def test_worked_packets(
    text: str,
    buttons: int,
    timer: int | None,
    analog: tuple[int, ...],
    encoders: int,
) -> None:
    data = bytes.fromhex(text)
    packet = decode_packet(data)
    assert packet == Packet(data[0] & 0x7F, buttons, timer, analog, COUNTS[:encoders])
    assert encode_packet(packet) == data


def test_lengths_of_all_layouts() -> None:
    assert {h: Layout(h & 0x7F).length for h in LENGTHS} == LENGTHS


@given(packets())
def test_packets_survive_the_line(packet: Packet) -> None:
    data = encode_packet(packet)
    assert decode_packet(data) == packet
    assert data[0] >= 0x80
    assert max(data[1:]) < 0x80


@given(packets(), st.data())
def test_bytes_that_break_the_form_are_refused(
    packet: Packet, data: st.DataObject
) -> None:
    raw = bytearray(encode_packet(packet))
    raw[data.draw(st.integers(0, len(raw) - 1))] ^= 0x80
    with pytest.raises(ValueError, match=r"bit 7|bytes"):
        decode_packet(bytes(raw))
    with pytest.raises(ValueError, match="bytes"):
        decode_packet(encode_packet(packet) + b"\0")


def test_values_must_suffice_for_the_layout() -> None:
    with pytest.raises(ValueError, match="wants more values"):
        encode_packet(Packet(0x03, 0, None, (), (1, 2)))
    with pytest.raises(ValueError, match="wants a timer"):
        encode_packet(Packet(0x20, 0))
    with pytest.raises(ValueError, match="standard command"):
        Layout(0x40)
