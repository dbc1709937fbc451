"""What is asked of a replay, and what is told of it: an event for all that happens.

The thread that shows tells them, but for `HeadLoaded` and what is measured, which the
measuring thread tells, and `MomentPicture`, which the thread of the snapshots does.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from paravol.feedback.hazard_pointer import HazardPointer
from paravol.flight.flight_events import HeadLoaded, Progressed
from paravol.patient import PatientScene
from paravol.sessions.session_pictures import ShownMoment
from paravol.sessions.time_marks import TimeMark
from paravol.snapshots.snapshot_queue import MomentPicture
from scenarios import Scenario
from scenarios.bundle import Note

Row = tuple[str, str, str]
"""A metric's name, its value, and that of the other session, "" without one."""


@dataclass(frozen=True, slots=True)
class ReplayOrder:
    """What is to be replayed.

    beside: another session, shown at the moment that belongs to the first one's. case:
    where the case that was flown through lies now. patient: the head, where it is
    loaded already, as it was before anybody operated. size: of the pictures, None as
    recorded: only those can be the same to the bit.
    """

    folder: Path
    beside: Path | None = None
    case: Path | None = None
    patient: PatientScene | None = None
    size: tuple[int, int] | None = None
    threads: int | None = None


@dataclass(frozen=True, slots=True)
class OpenedReplay:
    """What is known of a session before anything of it is shown.

    frame_times_s: of the recorded frames, or of the samples where there is none.
    aligned_by: landmarks and tasks that both sessions reached. is_complete: False where
    the recording ends in the middle; has_damage: where a part of it is lost.
    """

    order: ReplayOrder
    scenario: Scenario
    frame_times_s: list[float]
    begin_s: float
    end_s: float
    marks: list[TimeMark]
    notes: tuple[Note, ...]
    aligned_by: tuple[str, ...] = ()
    is_complete: bool = True
    has_damage: bool = False


@dataclass(frozen=True, slots=True)
class ShownReplay:
    """What is shown: the moment, and that of the session beside it.

    jump: number of the last jump that is done. is_free: whether another camera than the
    scope's looks on. tissue_changed: since anything was shown before. pointer: where
    the nearest hazard lies.
    """

    here: ShownMoment
    jump: int
    is_free: bool
    there: ShownMoment | None = None
    tissue_changed: bool = False
    pointer: HazardPointer | None = None


@dataclass(frozen=True, slots=True)
class ReplayFailed:
    """The session cannot be shown, or no longer; nothing comes after this.

    lacks_case: its case is not where it was.
    """

    error: Exception
    lacks_case: bool


@dataclass(frozen=True, slots=True)
class Seeking:
    """The way to a moment is long; share: of it that is done, 0 to 1."""

    share: float


@dataclass(frozen=True, slots=True)
class NotesChanged:
    """These are the notes now."""

    notes: tuple[Note, ...]


@dataclass(frozen=True, slots=True)
class Told:
    """Something was done, or could not be."""

    title: str
    detail: str


@dataclass(frozen=True, slots=True)
class Measuring:
    """The session is being measured; share: of it that is done, 0 to 1."""

    stage: str
    share: float


@dataclass(frozen=True, slots=True)
class Near:
    """Every moment up to this second is near; see `Keyframes`."""

    until_s: float


@dataclass(frozen=True, slots=True)
class Measured:
    """The session was measured: all marks, and its metrics."""

    marks: list[TimeMark]
    rows: list[Row]


@dataclass(frozen=True, slots=True)
class Unmeasured:
    """Nothing could be measured."""

    why: str


ReplayEvent = (
    Progressed
    | OpenedReplay
    | ReplayFailed
    | Seeking
    | ShownReplay
    | NotesChanged
    | Told
    | HeadLoaded
    | Measuring
    | Near
    | Measured
    | Unmeasured
    | MomentPicture
)
"""`HeadLoaded` has the patient as it is operated on; whoever hears it may be slow."""

HearReplay = Callable[[ReplayEvent], None]
"""What hears of a replay."""
