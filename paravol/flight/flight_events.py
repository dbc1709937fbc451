"""What is told of a flight: one kind of event for each thing that happens.

The thread that flies tells them, but for finished frames and kept moments, which the
thread tells that finished the frame.
"""

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from devices import DeviceError
from paravol.flight.flight_loop import FrameEvent
from paravol.patient import PatientScene
from paravol.scoring.score_table import score_rows
from paravol.sessions.session_store import KEPT_BYTES
from scenarios import Score
from scenarios.tasks import TaskEvent


@dataclass(frozen=True, slots=True)
class FlightEnd:
    """A flight's result.

    title: how it ended. record: folder of its recording, None where there is none.
    problem: why, or why a part of the flight is not there. automatic: nobody named a
    folder.
    """

    title: str
    score: Score
    record: Path | None = None
    automatic: bool = False
    problem: str = ""

    def rows(self) -> list[tuple[str, str]]:
        """Return the figures' names and texts, in order."""
        return score_rows(self.score)

    def where(self) -> str:
        """Return a line that says where the recording is."""
        if self.record is None:
            return f"Not recorded: {self.problem or 'nobody asked for it'}"
        if self.problem:
            return f"Recorded in part: {self.problem}"
        return f"Recorded in {self.record}"

    def lines(self) -> list[str]:
        """Return what can be done with the recording, for a terminal."""
        lines = [self.where()]
        if self.record is not None:
            command = f"paravol replay {shlex.quote(str(self.record))}"
            lines.append(f"Fly it again: {command}")
        if self.record is not None and self.automatic:
            lines.append(
                f"The newest {KEPT_BYTES / 1e9:g} GB of such flights are kept; "
                "--record NAME.paravol keeps one for good."
            )
        return lines


@dataclass(frozen=True, slots=True)
class Progressed:
    """A preparation goes on; share: of it that is done, 0 to 1."""

    stage: str
    share: float


@dataclass(frozen=True, slots=True)
class HeadLoaded:
    """The head is there."""

    patient: PatientScene


@dataclass(frozen=True, slots=True)
class Touching:
    """Fiducials are touched; told with every pose. share: of them that were."""

    stage: str
    share: float


@dataclass(frozen=True, slots=True)
class RecordingBegan:
    """The recording begins.

    residual_mm: of the registration, rms; None when nothing had to be touched.
    """

    residual_mm: float | None


@dataclass(frozen=True, slots=True)
class MomentKept:
    """A snapshot of this frame was asked for."""

    frame: FrameEvent


@dataclass(frozen=True, slots=True)
class ViewSaved:
    """A view was saved as a file, or not; where: it is, or why there is none."""

    message: str
    where: str


@dataclass(frozen=True, slots=True)
class Injured:
    """Something was hurt that must not be; text: what, and through what."""

    text: str


@dataclass(frozen=True, slots=True)
class DeviceLost:
    """The device went away; it is waited for."""

    loss: DeviceError


@dataclass(frozen=True, slots=True)
class DeviceBack:
    """The device is back, after so many seconds."""

    away_s: float


@dataclass(frozen=True, slots=True)
class StoodStill:
    """The flight stood still; text: what was left out by that."""

    text: str


@dataclass(frozen=True, slots=True)
class ToolDeviceNews:
    """The tool's device was lost, or is back; the flight goes on."""

    text: str


@dataclass(frozen=True, slots=True)
class RecordingStopped:
    """Nothing more is recorded; the flight goes on."""

    why: str


@dataclass(frozen=True, slots=True)
class FlightOver:
    """The flight is over, however it ended; see `Flight.result`."""

    result: FlightEnd | None


FlightEvent = (
    Progressed
    | HeadLoaded
    | Touching
    | RecordingBegan
    | FrameEvent
    | MomentKept
    | ViewSaved
    | Injured
    | TaskEvent
    | DeviceLost
    | DeviceBack
    | StoodStill
    | ToolDeviceNews
    | RecordingStopped
    | FlightOver
)

Hear = Callable[[FlightEvent], None]
"""What hears of a flight."""
