"""A conversation with a MicroScribe over a byte port, blocking."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from devices.microscribe.kinematics.arm import ArmGeometry, Encoders
from devices.microscribe.kinematics.constants_check import refuse_impossible
from devices.microscribe.wire import identity
from devices.microscribe.wire.commands import PING_LAYOUT, POSE_LAYOUT, Query
from devices.microscribe.wire.identity import ArmIdentity, Maxima, readable
from devices.microscribe.wire.line import Line, LinkTiming
from devices.microscribe.wire.packets import Packet, PacketLayout
from devices.microscribe.wire.protocol import (
    BadReply,
    HostSession,
    Reply,
    Sample,
    State,
)
from devices.microscribe.wire.sign_on import RATES, SignOn, end_session
from devices.port import BytePort, Clock, DeviceError, DeviceReason

# A stream that does not stop when told so three times will not.
STOP_TRIES = 3

# Newest polls that the time of a round trip is taken from.
ROUND_TRIPS = 100

# A line that damages three readings of a short block in a row carries no poses either.
READINGS = 4

TimedPacket = tuple[Packet, float]
"""A packet and the host's time of its header."""


@dataclass(frozen=True, slots=True)
class ArmDescription:
    """What an arm told about itself."""

    identity: ArmIdentity
    maxima: Maxima
    geometry: ArmGeometry

    @property
    def encoders(self) -> Encoders:
        """Return the resolution of the joints."""
        return Encoders(self.maxima.counts_per_turn)


class ArmLink:
    """Sign on, ask, poll or stream, recover and end, over any byte port.

    Not safe for two threads. Every failure is a DeviceError that names the port.
    """

    def __init__(
        self,
        port: BytePort,
        timing: LinkTiming | None = None,
        *,
        clock: Clock | None = None,
        confirmed_only: bool = False,
    ) -> None:
        self.session = HostSession(confirmed_only)
        self.port = port
        self.line = Line(port, self.session, clock)
        self.silence_s = 0.0
        """How long the last search for the arm heard nothing."""
        self._timing = timing or LinkTiming()
        self._period_s = 0.0
        self._trips_s: deque[float] = deque(maxlen=ROUND_TRIPS)
        self._begun = False
        """Whether the stream has brought a packet."""
        self._chunks: deque[tuple[int, float]] = deque()
        """Where chunks of a stream end, and when they came."""

    @property
    def baud(self) -> int:
        """Return the rate in use."""
        return self.line.baud

    @property
    def round_trip_s(self) -> float:
        """Return the median time from a poll to its whole answer, nan before the first.

        No less than the line needs, which is slept through without a look.
        """
        trips = list(self._trips_s)
        return median(trips) if trips else math.nan

    def sign_on(self, rates: Sequence[int] = RATES) -> None:
        """Open a session at the first of ``rates`` at which the arm answers."""
        search = SignOn(self.line, self._timing)
        began_s = self.line.clock.now()
        try:
            search.run(rates)
        finally:
            passed = self.line.clock.now() - began_s
            self.silence_s = passed if search.silence_s is None else search.silence_s

    def describe(self) -> ArmDescription:
        """Ask for everything that turns counts into poses, in the usual order.

        Blocks have no checksum: each is asked for until two readings agree. Raise
        DeviceError when none do, and for constants that no MicroScribe can have.
        """
        texts = [self._ask_text(Query(code)) for code in range(0xC8, 0xCF)]
        about = ArmIdentity(*texts)
        required = (Query.SERIAL, Query.PRODUCT_NAME, Query.MODEL, Query.FIRMWARE)
        # The strings come in the order of their codes.
        empty = [q.words for q in required if not texts[q.value - 0xC8]]
        if empty:
            raise DeviceError(
                DeviceReason.BAD_REPLY,
                f"The arm on {self.port.name} leaves its {' and '.join(empty)} empty; "
                "switch it off and on again, and check the cable.",
            )
        maxima = Maxima.decode(self._ask_twice(Query.MAXIMA))
        if about.parameter_format != identity.FORMAT:
            raise DeviceError(
                DeviceReason.UNSUPPORTED_FORMAT,
                f"The arm on {self.port.name} describes its joints as "
                f"'{about.parameter_format}'; only '{identity.FORMAT}' is known.",
            )
        block = self._ask_twice(Query.PARAMETERS)
        words = identity.decode_words(block, 18, "parameters")
        beta = 0
        if about.has_beta:
            raw = self._ask_twice(Query.EXTENDED)
            (beta,) = identity.decode_words(raw, 1, "extended parameters")
        geometry = ArmGeometry.from_words(words, beta)
        refuse_impossible(geometry, self.port.name)
        return ArmDescription(about, maxima, geometry)

    def serial_number(self) -> str:
        """Ask for the serial number."""
        return self._ask_text(Query.SERIAL)

    def home(self) -> None:
        """Load the rest pose's counts; the arm must stand in its rest."""
        self._ask(Query.HOME, self._timing.string)

    def sample(self) -> TimedPacket | None:
        """Poll once; return None if no packet came.

        A packet followed by further bytes is dropped: one of its own was doubled.
        """
        return self._poll(POSE_LAYOUT)

    def ping(self) -> bool:
        """Return whether the arm answers the shortest command after a flush."""
        self._settle()
        return self._poll(PING_LAYOUT) is not None

    def start_stream(self, period_ticks: int) -> None:
        """Let the arm send a pose every ``period_ticks`` of 1/900 s by itself."""
        self._period_s = max(period_ticks / 900.0, self._wire_s(POSE_LAYOUT))
        self._chunks.clear()
        self._begun = False
        self.line.send(self.session.stream(period_ticks))

    def streamed(self, patience_s: float = 0.0) -> list[TimedPacket]:
        """Wait for the stream's next packets; return none if it has fallen silent.

        With patience whatever comes in that time is taken together, which costs less.
        """
        clock, session = self.line.clock, self.session
        if patience_s > 0.0:
            clock.sleep(patience_s)
        allowed = max(self._timing.reply, 3.0 * self._period_s + 0.02)
        if not self._begun:
            # The echo of the command comes first, and a slow arm is slow with it, too.
            allowed += self._timing.reply
        now = clock.now()
        until = now + allowed
        while now < until:
            # A burst is taken whole, a trickle packet by packet.
            events = self.line.receive_some(session.missing_bytes, until - now)
            now = clock.now()
            self._chunks.append((session.received, now))
            found = [
                (event.packet, self._header_s(event.offset))
                for event in events
                if isinstance(event, Sample)
            ]
            if found:
                self._begun = True
                return found
        # Whatever came made no packet, and times of old chunks are worth nothing.
        self._chunks.clear()
        return []

    def stop_stream(self) -> None:
        """End the stream and what of it is still on its way.

        Raise DeviceError if the arm does not stop.
        """
        if self.session.state is not State.STREAMING:
            return
        for _ in range(STOP_TRIES):
            self.line.send(self.session.poll(PING_LAYOUT))
            self.session.abandon()
            if self.ping():
                return
        raise DeviceError(
            DeviceReason.BAD_REPLY,
            f"The arm on {self.port.name} goes on reporting its motion though told "
            "to stop; switch it off and on again.",
        )

    def end(self) -> None:
        """End the session and let the arm look for the next one."""
        end_session(self.line, self._timing)

    def _ask_text(self, query: Query) -> str:
        return identity.decode_string(self._ask(query, self._timing.string))

    def _ask_twice(self, query: Query) -> bytes:
        """Return a block that came alike twice in a row."""
        block = self._ask(query, self._timing.block)
        for _ in range(READINGS - 1):
            before, block = block, self._ask(query, self._timing.block)
            if block == before:
                return block
        raise DeviceError(
            DeviceReason.BAD_REPLY,
            f"The arm on {self.port.name} told its {query.name.lower()} differently "
            f"each time it was asked; try another cable or adapter.",
        )

    def _ask(self, query: Query, allowed_s: float) -> bytes:
        clock = self.line.clock
        self.line.send(self.session.ask(query))
        until = clock.now() + allowed_s
        while (now := clock.now()) < until:
            for event in self.line.receive(1, until - now):
                if isinstance(event, Reply):
                    return event.payload
                if isinstance(event, BadReply):
                    raise DeviceError(
                        DeviceReason.BAD_REPLY,
                        f"The arm on {self.port.name} answered the question for its "
                        f"{query.words} with {readable(event.raw)}; check the cable.",
                    )
        partial = self.session.partial
        self.session.abandon()
        raise DeviceError(
            DeviceReason.BAD_REPLY,
            f"The arm on {self.port.name} did not answer the question for its "
            f"{query.words} in time ({len(partial)} bytes came); switch it off and on "
            "again, and check the cable.",
        )

    def _poll(self, layout: PacketLayout) -> TimedPacket | None:
        clock = self.line.clock
        # What is still unread answered an earlier poll.
        self.line.drop()
        self.line.send(self.session.poll(layout))
        sent_s = now = clock.now()
        wire_s = self._wire_s(layout)
        # A doubled byte makes the packet longer by a byte that follows at once.
        quiet_s = max(self._timing.extra_bytes, 1.5 * self.line.byte_s)
        until = now + max(self._timing.reply, 3.0 * wire_s + 0.02)
        strays = self.session.stray
        # Sleeping until the whole answer must be there spares the wake-up at its
        # header and the one after its end.
        clock.sleep(self._timing.latency + wire_s + quiet_s)
        events = self.line.receive(layout.length + 1, 0.0)
        while True:
            now = clock.now()
            for event in events:
                if isinstance(event, Sample):
                    if self.session.stray > strays or self.port.waiting:
                        self._settle()
                        return None
                    self._trips_s.append(now - sent_s)
                    return event.packet, max(now - quiet_s - wire_s, sent_s)
            if now >= until:
                break
            missing = self.session.missing_bytes
            events = self.line.receive(missing + 1, until - now, quiet_s)
        self.session.abandon()
        # A late answer must not pass for that of the next poll.
        self._settle()
        return None

    def _header_s(self, offset: int) -> float:
        """Return when the byte at ``offset`` came; earlier ones are not asked for."""
        while self._chunks[0][0] <= offset and len(self._chunks) > 1:
            self._chunks.popleft()
        end, came_s = self._chunks[0]
        # Its own packet needed that long to come over the wire. The rest of a burst is
        # left out: not every adapter keeps to the rate, and too late does no harm.
        body = min(max(end - offset - 1, 0), POSE_LAYOUT.length - 1)
        return came_s - body * self.line.byte_s

    def _wire_s(self, layout: PacketLayout) -> float:
        return layout.length * self.line.byte_s

    def _settle(self) -> None:
        self.line.settle(self._timing.silence)
