"""The host's side of a MicroScribe session, without input or output.

Commands go in and give the bytes to send; received bytes go in and give events.
Whoever owns the port and the clock is somebody else: a timeout is told as
``abandon``. The life of a session is one table:

    OFF -> SYNC -> SYNCED -> OPENING -> IDLE -> ASKED | POLLED | STREAMING -> IDLE
"""

from collections import deque
from dataclasses import dataclass
from enum import IntEnum, auto
from typing import NamedTuple

from devices.microscribe.wire import commands
from devices.microscribe.wire.commands import Command, Query
from devices.microscribe.wire.identity import LONGEST_STRING
from devices.microscribe.wire.packet_reader import PacketCounters, PacketReader
from devices.microscribe.wire.packets import Packet, PacketLayout


class State(IntEnum):
    """Where a session stands."""

    OFF = auto()
    SYNC = auto()
    """Asking for attention."""
    SYNCED = auto()
    """Attention given; surplus echoes are dropped."""
    OPENING = auto()
    """BEGIN sent; the product id is awaited."""
    IDLE = auto()
    ASKED = auto()
    """A configuration command awaits its reply."""
    POLLED = auto()
    """A standard command awaits its packet."""
    STREAMING = auto()


class Step(IntEnum):
    """What moves a session."""

    CLEAR = auto()
    SIGN_ON = auto()
    ECHO = auto()
    BEGIN = auto()
    PRODUCT_ID = auto()
    ASK = auto()
    REPLY = auto()
    POLL = auto()
    PACKET = auto()
    STREAM = auto()
    ABANDON = auto()
    END = auto()


_RUN = (State.IDLE, State.ASKED, State.POLLED, State.STREAMING)

_ALLOWED: dict[tuple[State, Step], State] = {
    **{(state, Step.CLEAR): State.SYNC for state in State},
    # Its letters are commands to an arm that is not listening for them.
    (State.SYNC, Step.SIGN_ON): State.SYNC,
    (State.SYNCED, Step.SIGN_ON): State.SYNC,
    **{(state, Step.END): State.OFF for state in State},
    **{(state, Step.ABANDON): State.IDLE for state in _RUN},
    (State.SYNC, Step.ECHO): State.SYNCED,
    (State.SYNCED, Step.BEGIN): State.OPENING,
    (State.OPENING, Step.PRODUCT_ID): State.IDLE,
    (State.IDLE, Step.ASK): State.ASKED,
    (State.ASKED, Step.REPLY): State.IDLE,
    (State.IDLE, Step.POLL): State.POLLED,
    # A standard command ends a stream; packets of the old layout are hunted past.
    (State.STREAMING, Step.POLL): State.POLLED,
    (State.POLLED, Step.PACKET): State.IDLE,
    (State.IDLE, Step.STREAM): State.STREAMING,
    (State.STREAMING, Step.PACKET): State.STREAMING,
}

TRANSITIONS: dict[tuple[State, Step], State | None] = {
    (state, step): _ALLOWED.get((state, step)) for state in State for step in Step
}
"""Where every step leads from every state; None where it is refused."""


class ProtocolError(Exception):
    """A step that the session does not allow here; the text tells its history."""


@dataclass(frozen=True, slots=True)
class SyncEcho:
    """The device gave attention."""


@dataclass(frozen=True, slots=True)
class ProductId:
    """Everything that came between BEGIN and the first NUL."""

    raw: bytes


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to a configuration command, without echo, length or NUL."""

    query: Query
    payload: bytes


@dataclass(frozen=True, slots=True)
class BadReply:
    """A reply that cannot be valid; the session is idle again."""

    query: Query
    raw: bytes


class Sample(NamedTuple):
    """A standard packet."""

    packet: Packet
    offset: int = 0
    """Bytes that came in this session before its header."""


Event = SyncEcho | ProductId | Reply | BadReply | Sample

_STRINGS = frozenset(Query(code) for code in range(0xC8, 0xCF))
_COUNTED = frozenset((Query.PARAMETERS, Query.EXTENDED))
_FIXED_LENGTH = {Query.MAXIMA: 24, Query.HOME: 0, Query.END: 0}

_ATTENTION = commands.SIGN_ON_BYTES[1:]

# Surplus sign-on echoes (20 at most were ever needed) and one id.
_LONGEST_ID = 128


class HostSession:
    """One session with a MicroScribe, bytes in and events out."""

    def __init__(self, confirmed_only: bool = False) -> None:
        self.state = State.OFF
        self.stray = 0
        """Bytes that came when nothing was asked, or in front of an echo."""
        self.received = 0
        """All bytes that came."""
        self.counters = PacketCounters()
        """What the reader of samples saw; of pings only strays are told."""
        self._confirmed_only = confirmed_only
        self._story: deque[tuple[State, Step]] = deque(maxlen=20)
        self._buffer = bytearray()
        self._query = Query.END
        self._echo_due = False
        self._reader = PacketReader(PacketLayout(0))
        self._reader_began = 0

    @property
    def partial(self) -> bytes:
        """Return what has come of a reply or an id that is not complete."""
        return bytes(self._buffer)

    @property
    def missing_bytes(self) -> int:
        """Return how many bytes the next sample needs at least."""
        return self._reader.missing_bytes + self._echo_due

    def clear(self) -> Command:
        """Leave any session behind, an unfinished command included."""
        self._buffer.clear()
        self._move(Step.CLEAR)
        return commands.CLEAR

    def sign_on(self) -> Command:
        """Ask for attention; legal once the line was cleared."""
        self._move(Step.SIGN_ON)
        return commands.SIGN_ON

    def begin(self) -> Command:
        """Open the session; legal once per sign-on echo."""
        self._move(Step.BEGIN)
        self._buffer.clear()
        return commands.BEGIN

    def ask(self, query: Query) -> Command:
        """Ask a configuration question."""
        self._move(Step.ASK)
        self._query = query
        self._buffer.clear()
        return commands.ask(query)

    def poll(self, layout: PacketLayout) -> Command:
        """Ask for one packet; also ends a stream."""
        self._move(Step.POLL)
        self._echo_due = False
        self._read_packets(layout, confirmed_only=False)
        return commands.poll(layout)

    def stream(self, period_ticks: int) -> Command:
        """Ask for poses without end."""
        self._move(Step.STREAM)
        self._echo_due = True
        self._read_packets(commands.POSE_LAYOUT, self._confirmed_only)
        return commands.stream(period_ticks)

    def end(self) -> Command:
        """Close the session."""
        self._move(Step.END)
        return commands.ask(Query.END)

    def abandon(self) -> None:
        """Give up what is awaited."""
        self._move(Step.ABANDON)
        self._buffer.clear()

    def receive(self, data: bytes) -> list[Event]:
        """Take bytes as they come; return what they mean."""
        events: list[Event] = []
        at = 0
        while at < len(data):
            if self.state is State.STREAMING:
                at = self._scan_stream(data, at, events)
            elif self.state is State.POLLED:
                at = self._scan_packet(data, at, events)
            else:
                self._take(data[at], events)
                at += 1
        self.received += len(data)
        return events

    def _take(self, byte: int, events: list[Event]) -> None:
        if self.state is State.SYNC:
            self._scan_echo(byte, events)
        elif self.state is State.OPENING:
            self._scan_product_id(byte, events)
        elif self.state is State.ASKED:
            self._scan_reply(byte, events)
        elif self.state is State.IDLE:
            self.stray += 1

    def _scan_echo(self, byte: int, events: list[Event]) -> None:
        # A sliding window of four is the whole automaton: no letter of IMMC is lost
        # when the match before it fails.
        self._buffer = (self._buffer + bytes((byte,)))[-len(_ATTENTION) :]
        if self._buffer == _ATTENTION:
            self._buffer.clear()
            self._move(Step.ECHO)
            events.append(SyncEcho())

    def _scan_product_id(self, byte: int, events: list[Event]) -> None:
        if byte != 0 and len(self._buffer) < _LONGEST_ID:
            self._buffer.append(byte)
            return
        self._move(Step.PRODUCT_ID)
        events.append(ProductId(bytes(self._buffer)))

    def _scan_reply(self, byte: int, events: list[Event]) -> None:
        if not self._buffer and byte != self._query.value:
            self.stray += 1
            return
        self._buffer.append(byte)
        body = bytes(self._buffer[1:])
        if self._query in _STRINGS:
            if body.endswith(b"\0"):
                self._answer(events, Reply(self._query, body[:-1]))
            elif len(body) > LONGEST_STRING:
                self._answer(events, BadReply(self._query, body))
        elif self._query in _COUNTED:
            if body and len(body) == 1 + body[0]:
                self._answer(events, Reply(self._query, body[1:]))
        elif len(body) == _FIXED_LENGTH[self._query]:
            self._answer(events, Reply(self._query, body))

    def _answer(self, events: list[Event], event: Reply | BadReply) -> None:
        self._move(Step.REPLY)
        self._buffer.clear()
        events.append(event)

    def _read_packets(self, layout: PacketLayout, confirmed_only: bool) -> None:
        self._reader_began = self.received
        same = self._reader.layout.command == layout.command
        if same and self._reader.confirmed_only == confirmed_only:
            self._reader.restart()
            return
        # What a ping hunts past is the rest of a stream that it ends, and no noise.
        counters = self.counters if layout.encoders else PacketCounters()
        self._reader = PacketReader(layout, confirmed_only, counters)

    def _scan_packet(self, data: bytes, at: int, events: list[Event]) -> int:
        """Take no byte beyond the first packet: those answer nothing."""
        end = min(at + self._reader.missing_bytes, len(data))
        self._deliver(data[at:end], events)
        return end

    def _scan_stream(self, data: bytes, at: int, events: list[Event]) -> int:
        if self._echo_due:
            # The echo of the command may be glued to the first packet; what came
            # before it answered something older.
            echo = data.find(commands.MOTION, at)
            if echo >= 0:
                self._echo_due = False
                self.stray += echo - at
                self._read_packets(self._reader.layout, self._confirmed_only)
                self._reader_began += echo + 1
                return echo + 1
        self._deliver(data[at:], events)
        return len(data)

    def _deliver(self, data: bytes, events: list[Event]) -> None:
        for offset, packet in self._reader.receive(data):
            self._move(Step.PACKET)
            events.append(Sample(packet, self._reader_began + offset))

    def _move(self, step: Step) -> None:
        target = TRANSITIONS[self.state, step]
        if target is None:
            story = ", ".join(f"{a.name}--{b.name}" for a, b in self._story)
            raise ProtocolError(
                f"{step.name} is not possible in {self.state.name}; before that: "
                f"{story or 'nothing'}"
            )
        if step is not Step.PACKET:
            self._story.append((self.state, step))
        self.state = target
