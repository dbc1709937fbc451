"""A session joined to its port and its clock."""

from devices.microscribe.wire.commands import Command
from devices.microscribe.wire.protocol import Event, HostSession
from devices.microscribe.wire.transcript import Transcript
from devices.port import BytePort, Clock, HostClock

BITS_PER_BYTE = 10.0


class Line:
    """Send commands, receive events; nothing else may touch the port.

    Only a ``Command`` can be sent, so that what the arm hears is a closed list.
    """

    def __init__(
        self,
        port: BytePort,
        session: HostSession,
        clock: Clock | None = None,
        transcript: Transcript | None = None,
    ) -> None:
        self.port = port
        self.session = session
        self.clock = clock or HostClock()
        self.baud = 0
        self._transcript = transcript

    @property
    def name(self) -> str:
        """Get the port's name."""
        return self.port.name

    @property
    def byte_s(self) -> float:
        """Get the seconds that one byte takes."""
        return BITS_PER_BYTE / max(self.baud, 1)

    def set_rate(self, baud: int) -> None:
        """Change the rate and drop what was heard at another one."""
        self.port.set_rate(baud)
        self.baud = baud
        self.port.reset_input()

    def send(self, command: Command) -> None:
        """Say something to the arm."""
        if self._transcript is not None:
            now = self.clock.now()
            self._transcript.sent(now, self.session.state, command)
        self.port.write(command.data)

    def receive(self, count: int, timeout_s: float) -> list[Event]:
        """Wait for ``count`` bytes or the timeout; return what came."""
        return self._take(self.port.read(count, timeout_s))

    def receive_some(self, least: int, timeout_s: float) -> list[Event]:
        """Wait for ``least`` bytes or the timeout; take all that came."""
        return self._take(self.port.read_some(least, timeout_s))

    def receive_burst(
        self, count: int, timeout_s: float, quiet_s: float
    ) -> list[Event]:
        """Wait as ``receive`` does, but no longer than until the line falls quiet."""
        return self._take(self.port.read_burst(count, timeout_s, quiet_s))

    def drop(self) -> None:
        """Throw away what has arrived unread; it counts as stray."""
        if not self.port.waiting:
            return
        count = self.port.reset_input()
        self.session.stray += count
        if self._transcript is not None:
            self._transcript.dropped(self.clock.now(), self.session.state, count)

    def settle(self, seconds: float) -> None:
        """Let pass what is on its way, then drop it."""
        self.clock.sleep(seconds)
        self.drop()

    def _take(self, data: bytes) -> list[Event]:
        events = self.session.receive(data) if data else []
        if self._transcript is not None:
            now = self.clock.now()
            self._transcript.received(now, self.session.state, data, events)
        return events
