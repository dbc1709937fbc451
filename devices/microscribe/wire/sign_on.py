"""Finding an arm on a line: its rate, its attention, the opening of a session."""

from collections.abc import Sequence

from devices.microscribe.wire import commands, identity
from devices.microscribe.wire.commands import Command
from devices.microscribe.wire.identity import readable
from devices.microscribe.wire.line import Line, LinkTiming
from devices.microscribe.wire.protocol import Event, ProductId, State, SyncEcho
from devices.port import DeviceError, DeviceReason
from system import UserError

# The rate of the vendor's own software first, then those at which arms were seen.
RATES = (115200, 38400, 19200, 9600, 57600, 28800, 14400)


class SignOn:
    """One search for an arm over the rates it may listen at."""

    def __init__(self, line: Line, timing: LinkTiming) -> None:
        self._line = line
        self._timing = timing
        self._began_s = line.clock.now()
        self._heard_before = line.session.received
        self.silence_s: float | None = None
        """Seconds until the first byte came, None while none has."""

    def run(self, rates: Sequence[int]) -> None:
        """Open a session at the first of ``rates`` at which the arm answers.

        Two passes: an arm that a misunderstood command took to another rate is found
        in the second.
        """
        if not rates:
            raise UserError("at least one rate is needed")
        allowed = self._timing.per_rate if len(rates) > 1 else self._timing.forced_rate
        for baud in (*rates, *rates):
            self._line.set_rate(baud)
            if self._begin_at_this_rate(allowed):
                return
        name = self._line.port.name
        if self.silence_s is not None:
            raise DeviceError(
                DeviceReason.GARBAGE,
                f"The device on {name} sends bytes but none that a "
                "MicroScribe would send; check the cable, the rate and the port.",
            )
        raise DeviceError(
            DeviceReason.NO_DEVICE,
            f"No MicroScribe answered on {name}; check its power and the cable.",
        )

    def _begin_at_this_rate(self, allowed_s: float) -> bool:
        if not self._attention(allowed_s):
            return False
        # BEGIN is never repeated in the same session; a second try starts over.
        if self._open() or (self._attention(allowed_s) and self._open()):
            return True
        raise DeviceError(
            DeviceReason.CANT_BEGIN,
            f"The device on {self._line.port.name} answers but does not begin a "
            "session; switch it off and on again.",
        )

    def _attention(self, allowed_s: float) -> bool:
        """Return whether the arm echoed a sign-on; surplus echoes are dropped.

        The line is cleared first, so that the letters of a sign-on find no arm in the
        middle of a command, whatever was said to it before.
        """
        line = self._line
        until = line.clock.now() + allowed_s
        self._say(line.session.clear())
        while line.clock.now() < until:
            events = self._say(line.session.sign_on())
            if any(isinstance(event, SyncEcho) for event in events):
                self._drain()
                return True
        return False

    def _say(self, command: Command) -> list[Event]:
        """Send, and return what comes until the arm had time to look at it."""
        line = self._line
        line.send(command)
        wire_s = len(command.data) * line.byte_s
        events = line.receive(256, wire_s + self._timing.between_sign_ons)
        self._listen()
        return events

    def _listen(self) -> None:
        if self.silence_s is None and self._line.session.received > self._heard_before:
            self.silence_s = self._line.clock.now() - self._began_s

    def _drain(self) -> None:
        """Read until the surplus echoes end; a line may deliver them byte by byte."""
        session, clock = self._line.session, self._line.clock
        until = clock.now() + self._timing.surplus
        while clock.now() < until:
            before = session.received
            self._line.receive(256, self._timing.silence)
            if session.received == before:
                return

    def _open(self) -> bool:
        """Send BEGIN; return whether a MicroScribe gave its id, False if silent."""
        line, clock = self._line, self._line.clock
        line.send(line.session.begin())
        quiet_since = clock.now()
        until = quiet_since + self._timing.begin
        while (now := clock.now()) < until:
            before = line.session.received
            for event in line.receive(1, min(until - now, self._timing.silence)):
                if isinstance(event, ProductId):
                    self._check_product(event.raw)
                    return True
            if line.session.received > before:
                quiet_since = now
            elif now - quiet_since > self._timing.string and self._own_echo():
                raise DeviceError(
                    DeviceReason.LOOPBACK,
                    f"The port {line.port.name} returns our own bytes; its cable joins "
                    "the two data lines.",
                )
        return False

    def _own_echo(self) -> bool:
        heard = self._line.session.partial.replace(commands.SIGN_ON_BYTES, b"")
        return heard.replace(commands.SIGN_ON_BYTES[1:], b"") == commands.BEGIN_BYTES

    def _check_product(self, raw: bytes) -> None:
        if raw.endswith(identity.PRODUCT_ID.encode()):
            return
        end_session(self._line, self._timing)
        raise DeviceError(
            DeviceReason.WRONG_DEVICE,
            f"The device on {self._line.port.name} is no MicroScribe, it calls itself "
            f"{readable(raw)}.",
        )


def end_session(line: Line, timing: LinkTiming) -> None:
    """End the session and let the arm look for the next one; harmless when OFF."""
    if line.session.state is State.OFF:
        return
    if line.session.state is State.STREAMING:
        line.send(line.session.poll(commands.PING_LAYOUT))
        line.settle(timing.silence)
    line.send(line.session.end())
    line.clock.sleep(timing.settle)
