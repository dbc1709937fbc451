"""Pose after pose from one arm, through misread packets and interrupted lines."""

from collections.abc import Sequence
from enum import Enum

from devices.microscribe.link import ArmDescription, ArmLink
from devices.microscribe.tracker import SampleTracker
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose

# One lost packet is noise on the line; two in a row are a question.
MISSED_REPLIES = 2


class HomeState(Enum):
    """Whether the arm's angle registers can be trusted."""

    UNKNOWN = "unknown"
    ASSUMED = "assumed"
    """Somebody vouched that the arm stood in its rest when it was switched on."""
    HOMED = "homed this session"


class ArmSampler:
    """One arm from sign-on to end; blocking, for one thread."""

    def __init__(
        self, link: ArmLink, rates: Sequence[int], assume_home: bool = True
    ) -> None:
        self.home_state = HomeState.ASSUMED if assume_home else HomeState.UNKNOWN
        self.missed = 0
        """Polls that brought no packet, or one with bytes too many."""
        self.recoveries = 0
        """Times the line was found again after missed replies."""
        self._link = link
        self._missed_in_row = 0
        self._answered = False
        self._resumed = False
        link.sign_on(rates)
        self.description: ArmDescription = link.describe()
        self.tracker = SampleTracker(
            self.description.geometry,
            self.description.encoders,
            self.description.maxima.timer + 1,
        )

    def next_pose(self) -> Pose | None:
        """Poll once; return the pose, or None if this poll gave none.

        Raise DeviceError when the arm is gone, silent or talks nonsense for good.
        """
        sample = self._link.sample()
        if sample is None:
            self.missed += 1
            self._missed_in_row += 1
            if self._missed_in_row >= MISSED_REPLIES:
                self._recover()
            return None
        self._missed_in_row = 0
        self._answered = True
        packet, host_time_s = sample
        if self._resumed:
            self._resumed = False
            if self.tracker.lost_power(packet, host_time_s):
                self.home_state = HomeState.UNKNOWN
        if self.home_state is HomeState.UNKNOWN:
            return None
        return self.tracker.accept(packet, host_time_s)

    def home(self) -> None:
        """Load the rest counts; the arm must stand in its rest now."""
        self._link.home()
        self.home_state = HomeState.HOMED
        self.tracker.forget()

    def _recover(self) -> None:
        """Find the line again, first by a ping, then by signing on anew."""
        self._missed_in_row = 0
        name = self._link.port.name
        if not self._link.ping():
            try:
                self._link.sign_on((self._link.baud,))
                serial = self._link.serial_number()
            except DeviceError as error:
                raise self._lost(error) from error
            if serial != self.description.identity.serial:
                raise DeviceError(
                    DeviceReason.WRONG_DEVICE,
                    f"Another arm answers on {name} now: {serial!r} instead of "
                    f"{self.description.identity.serial!r}.",
                )
            self._resumed = True
            if not self._answered:
                raise DeviceError(
                    DeviceReason.NOT_HOMED,
                    f"The arm on {name} answers questions but gives no positions; "
                    "put it into its rest and press its home button.",
                )
            self._answered = False
        self.recoveries += 1

    def _lost(self, error: DeviceError) -> DeviceError:
        name = self._link.port.name
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
