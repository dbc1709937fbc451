"""One arm through being unplugged and plugged in again."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Protocol

from devices.microscribe.driver.sampler import ArmSampler, MotionReports
from devices.microscribe.wire.line import LinkTiming
from devices.microscribe.wire.link import ArmLink
from devices.microscribe.wire.sign_on import RATES
from devices.port import BytePort, Clock, DeviceError, HostClock
from devices.pose import Pose

# Twice the rate of a recorded path would bring nothing; the line carries 430 Hz.
POLL_HZ = 100.0

# After a loss the port is tried after this long, then after twice as long, ...
FIRST_RETRY_S = 0.5
LONGEST_RETRY_S = 10.0

# An arm that is there answers at once; a search should not hold up the next one.
RETRY_SIGN_ON_S = 0.5


class PortFinder(Protocol):
    """The ports of a machine."""

    def names(self) -> Sequence[str]:
        """Return the ports that are plugged in.

        Raise DeviceError when the arm cannot come back.
        """
        ...

    def open(self, name: str) -> BytePort:
        """Open a port; raise DeviceError if that cannot be."""
        ...


class Presence(Enum):
    """Whether the arm can be spoken to."""

    THERE = "there"
    LOST = "lost"
    """It is being looked for."""


@dataclass(frozen=True, slots=True)
class ArmSettings:
    """How an arm is to be read."""

    rates: Sequence[int] = RATES
    poll_hz: float = POLL_HZ
    reports: MotionReports | None = None
    """None: poll."""
    assume_home: bool = True
    timing: LinkTiming | None = None


class ConnectionSupervisor:
    """Keep one arm's session alive; blocking, for one thread.

    Without a finder a lost arm is an error. With one it is looked for: at the name it
    had and at ports that were not there when it was lost, for no other device should
    hear what a MicroScribe understands.
    """

    def __init__(
        self,
        port: BytePort,
        settings: ArmSettings,
        finder: PortFinder | None = None,
        clock: Clock | None = None,
    ) -> None:
        self.presence = Presence.THERE
        self.trouble: DeviceError | None = None
        """Why the arm is lost, or why it was not found the last time."""
        self.losses = 0
        self._settings = settings
        self._finder = finder
        self._clock = clock or HostClock()
        self.port = port
        self.link = self._link(port, settings.timing)
        try:
            self.sampler = ArmSampler(
                self.link, settings.rates, settings.assume_home, settings.reports
            )
        except BaseException:
            self.close()
            raise
        self.due_s = self._clock.now()
        """When the next step should be made."""
        self._known: frozenset[str] = frozenset()
        self._retry_s = FIRST_RETRY_S

    @property
    def counters(self) -> dict[str, int]:
        """Return what went wrong on the line so far, by name."""
        session, sampler = self.link.session, self.sampler
        packets = session.counters
        return {
            "packets": packets.packets,
            "framing": packets.framing,
            "noise": packets.noise,
            "suspect": packets.suspect,
            "stray": session.stray,
            "missed": sampler.missed,
            "recoveries": sampler.recoveries,
            "losses": self.losses,
            "refused": sampler.tracker.refused,
            "jumps": sampler.tracker.jumps,
        }

    def step(self, patience_s: float = 0.0) -> list[Pose]:
        """Poll, wait for the stream or look for the arm; return the poses.

        What a stream brings within ``patience_s`` may come together.
        Raise DeviceError when the arm is lost and not to be looked for.
        """
        if self.presence is Presence.LOST:
            self._look_for()
            return []
        try:
            poses = self.sampler.next_poses(patience_s)
        except DeviceError as error:
            if self._finder is None:
                raise
            self._lose(error)
            return []
        if self._settings.reports is None:
            # After a stall the missed polls are gone; nobody wants them at once.
            period = 1.0 / self._settings.poll_hz
            self.due_s = max(self.due_s + period, self._clock.now() - period)
        return poses

    def home(self) -> bool:
        """Load the rest counts; return whether the arm was there to hear it."""
        if self.presence is Presence.LOST:
            return False
        try:
            self.sampler.home()
        except DeviceError as error:
            if self._finder is None:
                raise
            self._lose(error)
            return False
        return True

    def close(self) -> None:
        """End the session and release the port; harmless when repeated."""
        try:
            if self.presence is Presence.THERE:
                self.link.end()
        finally:
            self.port.close()

    def _link(self, port: BytePort, timing: LinkTiming | None) -> ArmLink:
        reports = self._settings.reports
        return ArmLink(
            port,
            timing,
            clock=self._clock,
            confirmed_only=reports is not None and reports.confirmed_only,
        )

    def _lose(self, error: DeviceError) -> None:
        assert self._finder is not None
        self.presence = Presence.LOST
        self.trouble = error
        self.losses += 1
        self.port.close()
        self._known = frozenset(self._finder.names())
        self._retry_s = FIRST_RETRY_S
        self.due_s = self._clock.now() + self._retry_s

    def _look_for(self) -> None:
        assert self._finder is not None
        new = [name for name in self._finder.names() if name not in self._known]
        for name in dict.fromkeys((self.port.name, *new)):
            if self._found(name):
                return
        self._retry_s = min(2.0 * self._retry_s, LONGEST_RETRY_S)
        self.due_s = self._clock.now() + self._retry_s

    def _found(self, name: str) -> bool:
        assert self._finder is not None
        timing = self._settings.timing or LinkTiming()
        hasty = replace(timing, forced_rate=min(timing.forced_rate, RETRY_SIGN_ON_S))
        try:
            port = self._finder.open(name)
        except DeviceError as error:
            self.trouble = error
            return False
        link = self._link(port, hasty)
        try:
            self.sampler.resume(link)
        except DeviceError as error:
            self.trouble = error
            self._hang_up(link)
            return False
        counters, stray = self.link.session.counters, self.link.session.stray
        link.session.counters.add(counters)
        link.session.stray += stray
        self.port, self.link = port, link
        self.presence = Presence.THERE
        self.trouble = None
        self.due_s = self._clock.now()
        return True

    def _hang_up(self, link: ArmLink) -> None:
        """Leave a device that was not the one, or did not come to its senses."""
        try:
            link.end()
        except DeviceError as error:
            self.trouble = error
        finally:
            link.port.close()
