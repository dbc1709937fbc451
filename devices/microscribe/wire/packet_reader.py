"""Standard packets found in a stream of bytes, however it is cut."""

from dataclasses import dataclass, field

from devices.microscribe.wire.packets import Packet, PacketLayout, decode_packet


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

    def add(self, others: "PacketCounters") -> None:
        """Count what an earlier reader saw as well."""
        self.packets += others.packets
        self.framing += others.framing
        self.noise += others.noise
        self.suspect += others.suspect


@dataclass(slots=True)
class PacketReader:
    """Find packets of one layout in a stream of bytes.

    A byte with bit 7 set inside a packet ends it: a header begins the next one,
    anything else starts the hunt for a header. With ``confirmed_only`` a packet is
    delivered when a header follows it, which catches every dropped, doubled or
    inserted byte at the price of one packet of delay.

    Whole chunks are looked at, not bytes: at the line's fastest rate that is most of
    the difference between one and twenty percent of a core.
    """

    layout: PacketLayout
    confirmed_only: bool = False
    counters: PacketCounters = field(default_factory=PacketCounters)
    _header: int = field(init=False)
    _length: int = field(init=False)
    _rest: bytes = b""
    """The beginning of a packet that is not complete."""
    _passed: int = 0
    """Bytes received before ``_rest``."""
    _complete: tuple[int, bytes] | None = None
    """Offset and bytes of a packet whose successor has not been seen."""

    def __post_init__(self) -> None:
        self._header, self._length = self.layout.header, self.layout.length

    def restart(self) -> None:
        """Forget unfinished and unconfirmed packets; offsets begin at 0 again."""
        self._rest, self._passed, self._complete = b"", 0, None

    @property
    def missing_bytes(self) -> int:
        """Return how many bytes the next delivery needs at least."""
        missing = self._length - len(self._rest)
        if self.confirmed_only:
            return 1 if self._complete is not None else missing + 1
        return missing

    def receive(self, data: bytes) -> list[tuple[int, Packet]]:
        """Take bytes as they come; return the packets that became deliverable.

        Each comes with its offset: the bytes received before its header.
        """
        found: list[tuple[int, Packet]] = []
        buffer = self._rest + data if self._rest else data
        at, size = 0, len(buffer)
        while at < size:
            if buffer[at] != self._header:
                at = self._skip_noise(buffer, at)
                continue
            if self._complete is not None:
                if self.confirmed_only:
                    found.append((self._complete[0], decode_packet(self._complete[1])))
                self._complete = None
            end = at + self._length
            if not buffer[at + 1 : end].isascii():
                at = self._break_off(buffer, at + 1)
            elif end > size:
                break
            else:
                self.counters.packets += 1
                self._complete = (self._passed + at, buffer[at:end])
                if not self.confirmed_only:
                    found.append((self._passed + at, decode_packet(buffer[at:end])))
                at = end
        self._rest = buffer[at:]
        self._passed += at
        return found

    def _skip_noise(self, buffer: bytes, at: int) -> int:
        """Return where the next header stands, or the end."""
        header = buffer.find(self._header, at)
        end = len(buffer) if header < 0 else header
        self.counters.noise += end - at
        if self._complete is not None:
            self.counters.suspect += 1
            self._complete = None
        return end

    def _break_off(self, buffer: bytes, at: int) -> int:
        """Return where to go on after the byte that cut a packet short."""
        self.counters.framing += 1
        while buffer[at] < 0x80:
            at += 1
        return at if buffer[at] == self._header else at + 1
