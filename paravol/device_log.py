"""What a recording says of its device: that it went away, and that it came back."""

from dataclasses import dataclass

from devices import DeviceError
from scenarios import Session
from scenarios.bundle import EventRecord, SessionRecorder


@dataclass(frozen=True, slots=True)
class DeviceLog:
    """Note a device's absences at their times of the session."""

    recorder: SessionRecorder
    session: Session

    def lost(self, loss: DeviceError | TimeoutError) -> None:
        """Note that poses have ceased, and why."""
        self._note(0.0, str(loss))

    def returned(self, away_s: float) -> None:
        """Note that poses go on, so many seconds of the device's time later."""
        self._note(away_s, f"The device is back after {away_s:.1f} s.")

    def _note(self, later_s: float, text: str) -> None:
        time_s = self.session.score().duration_s + later_s
        self.recorder.add(EventRecord(time_s, "device", text))
