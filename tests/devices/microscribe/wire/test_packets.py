import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.wire.packets import Packet, PacketLayout, decode_packet
from tests.devices.microscribe.drawn_packets import encode_packet, packets


@given(packets(), st.data())
def test_bytes_that_break_the_form_are_refused(
    packet: Packet, data: st.DataObject
) -> None:
    raw = bytearray(encode_packet(packet))
    assert decode_packet(bytes(raw)) == packet
    raw[data.draw(st.integers(0, len(raw) - 1))] ^= 0x80
    for spoilt in (bytes(raw), encode_packet(packet) + b"\0"):
        with pytest.raises(ValueError, match=r"bit 7|bytes"):
            decode_packet(spoilt)


def test_a_layout_is_that_of_a_standard_command() -> None:
    with pytest.raises(ValueError, match="standard command"):
        PacketLayout(0x40)
