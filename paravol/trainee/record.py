"""What the progress store knows of one trainee, and whom else it knows."""

from dataclasses import dataclass
from pathlib import Path

from paravol.progress.session_entry import SessionEntry
from paravol.progress.store import ProgressStore
from paravol.trainee.exercises import Ladder, ladder_of
from system import UserError


@dataclass(frozen=True, slots=True)
class TraineeRecord:
    """A trainee's ladder.

    trainee: made-up name, "" for none. trainees: all names in the store. told: what the
    user must know of the store, "" for nothing.
    """

    trainee: str
    ladder: Ladder
    trainees: tuple[str, ...] = ()
    told: str = ""


def attempts_of(trainee: str, exercise: str, store: Path | None = None) -> int:
    """Return how many attempts at an exercise are kept; none in an unusable store."""
    try:
        return len(ProgressStore(store).sessions(trainee=trainee, exercise=exercise))
    except (UserError, OSError):
        return 0


def record_of(trainee: str, store: Path | None = None) -> TraineeRecord:
    """Return a trainee's record; a store that cannot be used is told and counts as new.

    store: its file, None for the user's.
    """
    sessions: list[SessionEntry] = []
    names: list[str] = []
    try:
        kept = ProgressStore(store)
        sessions, told = kept.sessions(trainee=trainee), kept.told
        names = kept.trainees()
    except UserError as error:
        told = f"Your results cannot be read: {error}"
    except OSError as error:
        told = f"Your results cannot be read: {error.strerror}: {error.filename}."
    named = tuple(name for name in names if name)
    return TraineeRecord(trainee, ladder_of(sessions), named, told)
