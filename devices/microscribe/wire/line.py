"""A session joined to its port and its clock, and how long to wait for an arm."""

from dataclasses import dataclass

from devices.microscribe.wire.commands import Command
from devices.microscribe.wire.protocol import Event, HostSession
from devices.port import BytePort, Clock, HostClock


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
    latency: float = 0.001
    """An arm thinks "just under a millisecond" before it answers a poll."""


BITS_PER_BYTE = 10.0


class Line:
    """Send commands, receive events; nothing else may touch the port.

    Only a ``Command`` can be sent, so that what the arm hears is a closed list.
    """

    def __init__(
        self, port: BytePort, session: HostSession, clock: Clock | None = None
    ) -> None:
        self.port = port
        self.session = session
        self.clock = clock or HostClock()
        self.baud = 0

    @property
    def byte_s(self) -> float:
        """Return the seconds that one byte takes."""
        return BITS_PER_BYTE / max(self.baud, 1)

    def set_rate(self, baud: int) -> None:
        """Change the rate and drop what was heard at another one."""
        self.port.set_rate(baud)
        self.baud = baud
        self.port.reset_input()

    def send(self, command: Command) -> None:
        """Send a command to the arm."""
        self.port.write(command.data)

    def receive(
        self, count: int, timeout_s: float, quiet_s: float | None = None
    ) -> list[Event]:
        """Wait for ``count`` bytes, the timeout or a pause; return what came."""
        return self._take(self.port.read(count, timeout_s, quiet_s))

    def receive_some(self, least: int, timeout_s: float) -> list[Event]:
        """Wait for ``least`` bytes or the timeout; take all that came."""
        return self._take(self.port.read_some(least, timeout_s))

    def drop(self) -> None:
        """Throw away what has arrived unread; it counts as stray."""
        if not self.port.waiting:
            return
        self.session.stray += self.port.reset_input()

    def settle(self, seconds: float) -> None:
        """Let pass what is on its way, then drop it."""
        self.clock.sleep(seconds)
        self.drop()

    def _take(self, data: bytes) -> list[Event]:
        return self.session.receive(data) if data else []
