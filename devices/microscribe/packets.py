"""Standard packets of the MicroScribe line.

A packet is ``header, buttons, [timer], [analog..., extra], [encoders...]``. Only the
header has bit 7 set, and that is the whole error detection: no checksum, no length,
no number. A flipped bit 0 to 6 cannot be seen here.
"""

from dataclasses import dataclass, field

# Bits 1-0 of a command; not in numeric order.
_ENCODERS = {0b00: 0, 0b01: 5, 0b11: 6, 0b10: 7}
_ANALOG = {0b00: 0, 0b01: 2, 0b10: 4, 0b11: 8}
_TIMESTAMP = 0x20
_HEADER = 0x80


@dataclass(frozen=True, slots=True)
class Layout:
    """What the packets answering one standard command contain."""

    command: int

    def __post_init__(self) -> None:
        if not 0 <= self.command < 0x40:
            raise ValueError(f"a standard command is 0..63, got {self.command}")

    @property
    def header(self) -> int:
        """Get the first byte of the packet."""
        return self.command | _HEADER

    @property
    def encoders(self) -> int:
        """Get how many encoders follow."""
        return _ENCODERS[self.command & 0b11]

    @property
    def analog(self) -> int:
        """Get how many analog channels follow."""
        return _ANALOG[self.command >> 2 & 0b11]

    @property
    def timed(self) -> bool:
        """Get whether the timer follows."""
        return bool(self.command & _TIMESTAMP)

    @property
    def length(self) -> int:
        """Get the bytes of a packet, header included."""
        extra = 1 if self.analog else 0
        return 2 + 2 * self.timed + self.analog + extra + 2 * self.encoders


@dataclass(frozen=True, slots=True)
class Packet:
    """One decoded standard packet."""

    command: int
    buttons: int
    timer: int | None = None
    """Ticks of 1/900 s, 14 bits."""
    analog: tuple[int, ...] = ()
    counts: tuple[int, ...] = ()
    """14 bits each."""


def decode_packet(data: bytes) -> Packet:
    """Read one packet; raise ValueError unless its bytes have the legal form."""
    layout = Layout(data[0] & ~_HEADER if data else 0)
    if len(data) != layout.length:
        raise ValueError(f"packet must have {layout.length} bytes, got {len(data)}")
    if data[0] < _HEADER or any(byte >= _HEADER for byte in data[1:]):
        raise ValueError(f"bit 7 belongs to the header alone, got {data.hex(' ')}")
    at = 2
    timer = None
    if layout.timed:
        timer, at = data[at] << 7 | data[at + 1], at + 2
    analog: tuple[int, ...] = ()
    if layout.analog:
        high, low = data[at : at + layout.analog], data[at + layout.analog]
        # The eighth channel's lowest bit has no place in the extra byte.
        analog = tuple(
            byte << 1 | (low >> 6 - i & 1 if i < 7 else 0)
            for i, byte in enumerate(high)
        )
        at += layout.analog + 1
    pairs = data[at:]
    counts = tuple(
        pairs[i] << 7 | pairs[i + 1] for i in range(0, 2 * layout.encoders, 2)
    )
    return Packet(layout.command, data[1], timer, analog, counts)


def encode_packet(packet: Packet) -> bytes:
    """Return the bytes of ``packet``; counts beyond the layout are left out."""
    layout = Layout(packet.command)
    if len(packet.counts) < layout.encoders or len(packet.analog) < layout.analog:
        raise ValueError(f"command {packet.command:02x} wants more values: {packet}")
    out = bytearray((layout.header, packet.buttons & 0x7F))
    if layout.timed:
        if packet.timer is None:
            raise ValueError(f"command {packet.command:02x} wants a timer: {packet}")
        out += _pair(packet.timer)
    if layout.analog:
        channels = packet.analog[: layout.analog]
        out += bytes(value >> 1 for value in channels)
        out.append(sum((value & 1) << 6 - i for i, value in enumerate(channels[:7])))
    for count in packet.counts[: layout.encoders]:
        out += _pair(count)
    return bytes(out)


def _pair(value: int) -> bytes:
    return bytes((value >> 7 & 0x7F, value & 0x7F))


@dataclass(slots=True)
class PacketCounters:
    """What a packet reader has seen."""

    packets: int = 0
    framing: int = 0
    """Packets cut short by a byte with bit 7 set."""
    noise: int = 0
    """Bytes outside any packet."""
    suspect: int = 0
    """Packets that were followed by something else than a header."""


@dataclass(slots=True)
class PacketReader:
    """Find packets of one layout in a stream of bytes.

    A byte with bit 7 set inside a packet ends it: a header begins the next one,
    anything else starts the hunt for a header. With ``confirmed_only`` a packet is
    delivered when a header follows it, which catches every dropped, doubled or
    inserted byte at the price of one packet of delay.
    """

    layout: Layout
    confirmed_only: bool = False
    counters: PacketCounters = field(default_factory=PacketCounters)
    _header: int = field(init=False)
    _length: int = field(init=False)
    _partial: bytearray | None = None
    _complete: bytes | None = None

    def __post_init__(self) -> None:
        self._header, self._length = self.layout.header, self.layout.length

    @property
    def partial_bytes(self) -> int:
        """Get how many bytes of an unfinished packet have come."""
        return len(self._partial or b"")

    def receive(self, data: bytes) -> list[Packet]:
        """Take bytes as they come; return the packets that they completed."""
        found: list[Packet] = []
        for byte in data:
            self._take(byte, found)
        return found

    def _take(self, byte: int, found: list[Packet]) -> None:
        if byte == self._header:
            if self._partial is not None:
                self.counters.framing += 1
            if self._complete is not None and self.confirmed_only:
                found.append(decode_packet(self._complete))
            self._complete = None
            self._partial = bytearray((byte,))
        elif self._partial is None:
            self.counters.noise += 1
            if self._complete is not None:
                self.counters.suspect += 1
                self._complete = None
        elif byte >= _HEADER:
            self.counters.framing += 1
            self._partial = None
        else:
            self._partial.append(byte)
        if self._partial is not None and len(self._partial) == self._length:
            self._complete, self._partial = bytes(self._partial), None
            self.counters.packets += 1
            if not self.confirmed_only:
                found.append(decode_packet(self._complete))
