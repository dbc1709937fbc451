"""A conversation with a MicroScribe over a byte port, blocking."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from devices.microscribe import commands, identity
from devices.microscribe.arm import ArmGeometry, Encoders
from devices.microscribe.commands import Command, Query
from devices.microscribe.identity import ArmIdentity, Maxima
from devices.microscribe.packets import Layout, Packet
from devices.microscribe.protocol import (
    BadReply,
    Event,
    HostSession,
    ProductId,
    Reply,
    Sample,
    State,
    SyncEcho,
)
from devices.port import BytePort, DeviceError, DeviceReason

# The rate of the vendor's own software first, then those at which arms were seen.
RATES = (115200, 38400, 19200, 9600, 57600, 28800, 14400)

# Six encoders with the timer, 16 bytes.
POSE_LAYOUT = Layout(0x23)
_PING_LAYOUT = Layout(0x00)


@dataclass(frozen=True, slots=True)
class LinkTiming:
    """How long to wait, in seconds."""

    between_sign_ons: float = 0.015
    """The arm needs this to look at what it heard."""
    per_rate: float = 1.0
    """The arm itself walks through seven rates."""
    forced_rate: float = 1.5
    """Per pass when only one rate is allowed."""
    silence: float = 0.05
    """Longer than any pause inside what an arm has to say."""
    surplus: float = 0.5
    """Sign-on echoes end by then."""
    begin: float = 3.0
    reply: float = 0.1
    """At least; a slow line is given three times its wire time."""
    string: float = 0.5
    block: float = 3.0
    settle: float = 0.015
    """Between the last command and closing the port."""
    extra_bytes: float = 0.0005
    """A doubled byte follows its packet by one byte time (0.09 ms at 115200)."""


@dataclass(frozen=True, slots=True)
class ArmDescription:
    """What an arm told about itself."""

    identity: ArmIdentity
    maxima: Maxima
    geometry: ArmGeometry

    @property
    def encoders(self) -> Encoders:
        """Get the resolution of the joints."""
        return Encoders(self.maxima.counts_per_turn)


class ArmLink:
    """Sign on, ask, poll, recover and end, over any byte port.

    Not safe for two threads. Every failure is a DeviceError that names the port.
    """

    def __init__(self, port: BytePort, timing: LinkTiming | None = None) -> None:
        self.port = port
        self.session = HostSession()
        self.baud = 0
        self._timing = timing or LinkTiming()
        self._heard = 0

    def sign_on(self, rates: Sequence[int] = RATES) -> None:
        """Open a session at the first of ``rates`` at which the arm answers."""
        if not rates:
            raise ValueError("at least one rate is needed")
        self._heard = 0
        for opening in (None, commands.FLUSH_MOTION):
            for baud in rates:
                self.port.set_rate(baud)
                self.baud = baud
                self.port.reset_input()
                if self._begin_at_this_rate(opening, len(rates) == 1):
                    return
        if self._heard:
            raise DeviceError(
                DeviceReason.GARBAGE,
                f"The device on {self.port.name} sends bytes but none that a "
                "MicroScribe would send; check the cable, the rate and the port.",
            )
        raise DeviceError(
            DeviceReason.NO_DEVICE,
            f"No MicroScribe answered on {self.port.name}; check its power and the "
            "cable.",
        )

    def describe(self) -> ArmDescription:
        """Ask for everything that turns counts into poses, in the usual order."""
        texts = [self._ask_text(Query(code)) for code in range(0xC8, 0xCF)]
        about = ArmIdentity(*texts)
        maxima = Maxima.decode(self._ask(Query.MAXIMA, self._timing.block))
        if about.parameter_format != identity.FORMAT:
            raise DeviceError(
                DeviceReason.UNSUPPORTED_FORMAT,
                f"The arm on {self.port.name} describes its joints as "
                f"{about.parameter_format!r}; only {identity.FORMAT!r} is known.",
            )
        block = self._ask(Query.PARAMETERS, self._timing.block)
        words = identity.decode_words(block, 18, "parameters")
        beta = 0
        if about.has_beta:
            raw = self._ask(Query.EXTENDED, self._timing.block)
            (beta,) = identity.decode_words(raw, 1, "extended parameters")
        return ArmDescription(about, maxima, ArmGeometry.from_words(words, beta))

    def serial_number(self) -> str:
        """Ask for the serial number."""
        return self._ask_text(Query.SERIAL)

    def home(self) -> None:
        """Load the rest pose's counts; the arm must stand in its rest."""
        self._ask(Query.HOME, self._timing.string)

    def sample(self) -> tuple[Packet, float] | None:
        """Poll once; return packet and host time of its header, None if none came.

        A packet followed by further bytes is dropped: one of its own was doubled.
        """
        return self._poll(POSE_LAYOUT)

    def ping(self) -> bool:
        """Return whether the arm answers the shortest command after a flush."""
        self._settle()
        return self._poll(_PING_LAYOUT) is not None

    def end(self) -> None:
        """End the session and let the arm look for the next one."""
        if self.session.state is State.OFF:
            return
        if self.session.state is State.STREAMING:
            self.ping()
        self._send(self.session.end())
        time.sleep(self._timing.settle)

    def _begin_at_this_rate(self, opening: Command | None, forced: bool) -> bool:
        allowed = self._timing.forced_rate if forced else self._timing.per_rate
        if not self._attention(opening, allowed):
            return False
        # BEGIN is never repeated in the same session; a second try starts over.
        if self._open() or (self._attention(None, allowed) and self._open()):
            return True
        raise DeviceError(
            DeviceReason.CANT_BEGIN,
            f"The device on {self.port.name} answers but does not begin a session; "
            "switch it off and on again.",
        )

    def _attention(self, opening: Command | None, allowed_s: float) -> bool:
        """Return whether the arm echoed a sign-on; surplus echoes are dropped."""
        start = time.monotonic()
        zero_due = opening is None
        if opening is not None:
            self._send(opening)
        while (passed := time.monotonic() - start) < allowed_s:
            if zero_due and passed > allowed_s / 2.0:
                self._send(commands.PING)
                zero_due = False
            self._send(self.session.sign_on())
            events = self._receive(256, self._timing.between_sign_ons)
            if any(isinstance(event, SyncEcho) for event in events):
                self._drain()
                return True
        return False

    def _drain(self) -> None:
        until = time.monotonic() + self._timing.surplus
        while time.monotonic() < until and self.port.read(256, self._timing.silence):
            pass

    def _open(self) -> bool:
        """Send BEGIN; return whether a MicroScribe gave its id, False if silent."""
        self._send(self.session.begin())
        until = time.monotonic() + self._timing.begin
        quiet_since = time.monotonic()
        while (now := time.monotonic()) < until:
            before = self._heard
            for event in self._receive(1, min(until - now, self._timing.silence)):
                if isinstance(event, ProductId):
                    self._check_product(event.raw)
                    return True
            if self._heard > before:
                quiet_since = time.monotonic()
            elif now - quiet_since > self._timing.string and self._own_echo():
                raise DeviceError(
                    DeviceReason.LOOPBACK,
                    f"The port {self.port.name} returns our own bytes; its cable joins "
                    "the two data lines.",
                )
        return False

    def _own_echo(self) -> bool:
        heard = self.session.partial.replace(commands.SIGN_ON_BYTES, b"")
        return heard.replace(commands.SIGN_ON_BYTES[1:], b"") == commands.BEGIN_BYTES

    def _check_product(self, raw: bytes) -> None:
        if raw.endswith(identity.PRODUCT_ID.encode()):
            return
        self.end()
        raise DeviceError(
            DeviceReason.WRONG_DEVICE,
            f"The device on {self.port.name} is no MicroScribe, it calls itself "
            f"{raw!r}.",
        )

    def _ask_text(self, query: Query) -> str:
        return identity.decode_string(self._ask(query, self._timing.string))

    def _ask(self, query: Query, allowed_s: float) -> bytes:
        self._send(self.session.ask(query))
        until = time.monotonic() + allowed_s
        while (now := time.monotonic()) < until:
            for event in self._receive(1, until - now):
                if isinstance(event, Reply):
                    return event.payload
                if isinstance(event, BadReply):
                    raise DeviceError(
                        DeviceReason.BAD_REPLY,
                        f"The arm on {self.port.name} answered {query.name} with "
                        f"{event.raw!r}.",
                    )
        partial = self.session.partial
        self.session.abandon()
        raise DeviceError(
            DeviceReason.BAD_REPLY,
            f"The arm on {self.port.name} did not answer {query.name} in time "
            f"({len(partial)} bytes came).",
        )

    def _poll(self, layout: Layout) -> tuple[Packet, float] | None:
        wire_s = 10.0 * layout.length / max(self.baud, 1)
        # What is still unread answered an earlier poll.
        self.session.stray += self.port.reset_input()
        self._send(self.session.poll(layout))
        header_s = now = time.monotonic()
        until = now + max(self._timing.reply, 3.0 * wire_s + 0.02)
        while now < until:
            come = self.session.packet_bytes
            # The header is read alone, so that its arrival can be told.
            events = self._receive(layout.length - come if come else 1, until - now)
            now = time.monotonic()
            if come == 0:
                header_s = now
            for event in events:
                if isinstance(event, Sample):
                    return None if self._followed() else (event.packet, header_s)
        self.session.abandon()
        # A late answer must not pass for that of the next poll.
        self._settle()
        return None

    def _settle(self) -> None:
        time.sleep(self._timing.silence)
        self.session.stray += self.port.reset_input()

    def _followed(self) -> bool:
        """Return whether bytes came after a complete packet."""
        before = self.session.stray
        self._receive(256, self._timing.extra_bytes)
        return self.session.stray > before

    def _send(self, command: Command) -> None:
        self.port.write(command.data)

    def _receive(self, count: int, timeout_s: float) -> list[Event]:
        data = self.port.read(count, timeout_s)
        self._heard += len(data)
        return self.session.receive(data)
