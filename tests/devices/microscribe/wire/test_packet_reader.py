import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.wire.packet_reader import PacketCounters, PacketReader
from devices.microscribe.wire.packets import Packet, PacketLayout, decode_packet
from tests.devices.microscribe.drawn_packets import encode_packet, packets

POSE = bytes.fromhex("A3 01 7F 7F 6C 4F 30 5E 35 54 20 02 18 79 41 60")


class _ByteReader:
    """The rule itself, byte for byte: what the reader of whole chunks must equal."""

    def __init__(self, layout: PacketLayout, confirmed_only: bool) -> None:
        self.counters = PacketCounters()
        self._layout, self._confirmed_only = layout, confirmed_only
        self._partial: bytearray | None = None
        self._complete: bytes | None = None

    def receive(self, data: bytes) -> list[Packet]:
        found: list[Packet] = []
        for byte in data:
            self._take(byte, found)
        return found

    def _take(self, byte: int, found: list[Packet]) -> None:
        if byte == self._layout.header:
            if self._partial is not None:
                self.counters.framing += 1
            if self._complete is not None and self._confirmed_only:
                found.append(decode_packet(self._complete))
            self._complete = None
            self._partial = bytearray((byte,))
        elif self._partial is None:
            self.counters.noise += 1
            if self._complete is not None:
                self.counters.suspect += 1
                self._complete = None
        elif byte >= 0x80:
            self.counters.framing += 1
            self._partial = None
        else:
            self._partial.append(byte)
        whole = self._partial is not None and len(self._partial) == self._layout.length
        if whole and self._partial is not None:
            self._complete, self._partial = bytes(self._partial), None
            self.counters.packets += 1
            if not self._confirmed_only:
                found.append(decode_packet(self._complete))


def _packets(reader: PacketReader, data: bytes) -> list[Packet]:
    return [packet for _, packet in reader.receive(data)]


_pose_packets = st.lists(packets(0x23), min_size=5, max_size=8)


def _damage(raw: bytes, kind: str, at: int, byte: int) -> bytes:
    if kind == "drop":
        return raw[:at] + raw[at + 1 :]
    if kind == "double":
        return raw[: at + 1] + raw[at:]
    if kind == "insert":
        return raw[:at] + bytes((byte,)) + raw[at:]
    if kind == "bit 7":
        return raw[:at] + bytes((raw[at] ^ 0x80,)) + raw[at + 1 :]
    return raw[:at]


_kinds = st.sampled_from(["drop", "double", "insert", "bit 7", "cut"])


@given(_pose_packets, _kinds, st.integers(0, 15), st.integers(0, 255))
def test_no_confirmed_packet_was_not_sent(
    sent: list[Packet], kind: str, at: int, byte: int
) -> None:
    chunks = [encode_packet(packet) for packet in sent]
    chunks[2] = _damage(chunks[2], kind, at, byte)
    reader = PacketReader(PacketLayout(0x23), confirmed_only=True)
    got: list[Packet] = []
    for value in b"".join(chunks):
        got += _packets(reader, bytes((value,)))
    # The last one lacks its successor. Around the damage at most its own packet and
    # the one before (whose successor is spoilt) may be missing; nothing else is.
    assert [packet for packet in got if packet not in sent] == []
    lost = len(sent) - 1 - len(got)
    assert 0 <= lost <= 2
    assert got[:1] == sent[:1]
    assert got[len(got) - (len(sent) - 4) :] == sent[3:-1]
    # a packet that is missing as a whole leaves no trace on this line
    if lost and not (kind == "cut" and at == 0):
        assert reader.counters.framing + reader.counters.noise > 0


@given(_pose_packets, _kinds, st.integers(0, 15), st.integers(0, 255))
def test_immediate_delivery_is_back_in_step_within_one_packet(
    sent: list[Packet], kind: str, at: int, byte: int
) -> None:
    chunks = [encode_packet(packet) for packet in sent]
    chunks[2] = _damage(chunks[2], kind, at, byte)
    reader = PacketReader(PacketLayout(0x23))
    got = _packets(reader, b"".join(chunks))
    assert got[:2] == sent[:2]
    assert got[-(len(sent) - 3) :] == sent[3:]


# Bytes as they occur around packets: legal packets, pieces of them, anything.
_streams = st.lists(
    st.one_of(
        st.just(POSE),
        st.integers(0, 15).map(lambda n: POSE[:n]),
        st.integers(1, 16).map(lambda n: POSE[n:]),
        st.binary(max_size=5),
        st.sampled_from([b"\xa3", b"\x80", b"\xcf", b"\x00"]),
    ),
    max_size=12,
).map(b"".join)


@given(_streams, st.booleans(), st.lists(st.integers(1, 40), min_size=1, max_size=20))
def test_chunks_give_what_single_bytes_give(
    raw: bytes, confirmed_only: bool, cuts: list[int]
) -> None:
    reader = PacketReader(PacketLayout(0x23), confirmed_only)
    rule = _ByteReader(PacketLayout(0x23), confirmed_only)
    got: list[Packet] = []
    at = 0
    for step in cuts * (len(raw) + 1):
        got += _packets(reader, raw[at : at + step])
        at += step
        if at >= len(raw):
            break
    assert got == rule.receive(raw)
    assert reader.counters == rule.counters


@given(_streams, st.booleans())
def test_offsets_point_at_headers(raw: bytes, confirmed_only: bool) -> None:
    reader = PacketReader(PacketLayout(0x23), confirmed_only)
    for cut in (len(raw) // 3, len(raw) // 2):
        reader.restart()
        for at, packet in reader.receive(raw[:cut]) + reader.receive(raw[cut:]):
            assert raw[at : at + 16] == encode_packet(packet)


@given(_streams, st.booleans())
def test_no_delivery_with_fewer_than_the_missing_bytes(
    raw: bytes, confirmed_only: bool
) -> None:
    """What is said to be missing is a bound that a waiting reader may rely on."""
    reader = PacketReader(PacketLayout(0x23), confirmed_only)
    at = 0
    while at < len(raw):
        missing = reader.missing_bytes
        assert missing >= 1
        assert reader.receive(raw[at : at + missing - 1]) == []
        reader.receive(raw[at + missing - 1 : at + missing])
        at += missing


@pytest.mark.parametrize("command", [c for c in range(0x40) if not c & 0x10])
def test_every_layout_is_found_in_a_stream(command: int) -> None:
    layout = PacketLayout(command)
    timer = 5 if layout.timed else None
    packet = Packet(command, 1, timer, (3,) * layout.encoders)
    raw = encode_packet(packet) * 3
    assert len(raw) == 3 * layout.length
    reader = PacketReader(layout)
    assert [found for byte in raw for found in _packets(reader, bytes((byte,)))] == [
        packet
    ] * 3
