"""Pose after pose from one arm, through misread packets and interrupted lines."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from devices.microscribe.driver.tracker import SampleTracker
from devices.microscribe.wire.link import ArmDescription, ArmLink, TimedPacket
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose

# One lost packet is noise on the line; two in a row are a question.
MISSED_REPLIES = 2

# An arm with power answers a sign-on within a fraction of a second.
POWERLESS_S = 2.0


class HomeState(Enum):
    """Whether the arm's angle registers can be trusted."""

    UNKNOWN = "unknown"
    ASSUMED = "assumed"
    """Somebody vouched that the arm stood in its rest when it was switched on."""
    HOMED = "homed this session"


@dataclass(frozen=True, slots=True)
class MotionReports:
    """Let the arm send by itself instead of polling it.

    The faster of the two, and indifferent to adapters that deliver in bursts. The
    period is in ticks of 1/900 s, 0 to 15; what the line cannot carry comes as fast
    as it can. ``confirmed_only`` gives a pose when the next packet has begun, which
    costs one period of delay and lets no dropped or doubled byte pass.
    """

    period_ticks: int = 2
    confirmed_only: bool = True


class ArmSampler:
    """One arm from sign-on to end; blocking, for one thread."""

    def __init__(
        self,
        link: ArmLink,
        rates: Sequence[int],
        assume_home: bool = True,
        reports: MotionReports | None = None,
    ) -> None:
        self.home_state = HomeState.ASSUMED if assume_home else HomeState.UNKNOWN
        self.missed = 0
        """Polls that brought no packet, or one with bytes too many; in a stream,
        times it fell silent."""
        self.recoveries = 0
        """Times the line was found again after missed replies."""
        self._link = link
        self._reports = reports
        self._missed_in_row = 0
        self._answered = False
        self._resumed = False
        self._silence_s = 0.0
        link.sign_on(rates)
        self.description: ArmDescription = link.describe()
        self.tracker = SampleTracker(
            self.description.geometry,
            self.description.encoders,
            self.description.maxima.timer + 1,
        )
        self._start()

    def next_poses(self, patience_s: float = 0.0) -> list[Pose]:
        """Poll once or wait for the stream; return the poses that came of it.

        What a stream brings within ``patience_s`` may come together.
        Raise DeviceError when the arm is gone, silent or talks nonsense for good.
        """
        packets = self._packets(patience_s)
        if not packets:
            self.missed += 1
            self._missed_in_row += 1
            if self._missed_in_row >= MISSED_REPLIES:
                self._recover()
            return []
        self._missed_in_row = 0
        self._answered = True
        if self._resumed:
            self._resumed = False
            if self.tracker.lost_power(*packets[0]):
                self.home_state = HomeState.UNKNOWN
        if self.home_state is HomeState.UNKNOWN:
            return []
        poses = []
        for packet, time_s in packets:
            pose = self.tracker.accept(packet, time_s)
            if pose is not None:
                poses.append(pose)
        return poses

    def home(self) -> None:
        """Load the rest counts; the arm must stand in its rest now."""
        self._link.stop_stream()
        self._link.home()
        self.home_state = HomeState.HOMED
        self.tracker.forget()
        self._start()

    def resume(self, link: ArmLink) -> None:
        """Go on with the same arm over a new link at the rate of the old one.

        Raise DeviceError when another arm answers there, or none.
        """
        self._sign_on_again(link, self._link.baud)
        self._link = link
        self._answered = False
        self._start()

    def _packets(self, patience_s: float) -> list[TimedPacket]:
        if self._reports is not None:
            return self._link.streamed(patience_s)
        sample = self._link.sample()
        return [] if sample is None else [sample]

    def _start(self) -> None:
        if self._reports is not None:
            self._link.start_stream(self._reports.period_ticks)

    def _recover(self) -> None:
        """Find the line again, first by a ping, then by signing on anew."""
        self._missed_in_row = 0
        if not self._still_there():
            try:
                self._sign_on_again(self._link, self._link.baud)
            except DeviceError as error:
                raise self._lost(error) from error
            if not self._answered:
                raise DeviceError(
                    DeviceReason.NOT_HOMED,
                    f"The arm on {self._link.port.name} answers questions but gives "
                    "no positions; put it into its rest and press its home button.",
                )
            self._answered = False
        self.recoveries += 1
        self._start()

    def _still_there(self) -> bool:
        if self._reports is None:
            return self._link.ping()
        try:
            self._link.stop_stream()
        except DeviceError as error:
            if error.reason is DeviceReason.DISCONNECTED:
                raise
            return False
        return True

    def _sign_on_again(self, link: ArmLink, baud: int) -> None:
        try:
            link.sign_on((baud,))
        finally:
            self._silence_s += link.silence_s
        serial = link.serial_number()
        known = self.description.identity.serial
        if serial != known:
            raise DeviceError(
                DeviceReason.WRONG_DEVICE,
                f"Another arm answers on {link.port.name} now: {serial!r} instead of "
                f"{known!r}.",
            )
        if self._silence_s > POWERLESS_S:
            self.home_state = HomeState.UNKNOWN
        self._silence_s = 0.0
        self._resumed = True

    def _lost(self, error: DeviceError) -> DeviceError:
        name = self._link.port.name
        if error.reason is DeviceReason.WRONG_DEVICE:
            return error
        if error.reason is DeviceReason.GARBAGE:
            return DeviceError(
                DeviceReason.GARBAGE,
                f"The line on {name} delivers bytes that are no packets; check the "
                "cable.",
            )
        return DeviceError(
            DeviceReason.DISCONNECTED,
            f"The arm on {name} fell silent; check its power and the cable.",
        )
