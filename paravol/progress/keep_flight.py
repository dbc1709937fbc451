"""What happens to a flight when it is over: it is scored, and kept for its trainee."""

from dataclasses import dataclass
from pathlib import Path

from paravol.patient import PatientScene
from paravol.progress.session_entry import SessionEntry, entry_of_session
from paravol.progress.store import ProgressStore
from paravol.scoring.session_metrics import session_metrics
from paravol.scoring.session_scoring import assessment_of, fitting_rubric
from paravol.scoring.verdict_texts import whole_text
from scenarios.bundle import read_recording
from scenarios.rubrics import Assessment
from system import UserError


@dataclass(frozen=True, slots=True)
class KeptFlight:
    """Tell what was kept.

    entry: as it is in the store; None where it could not be kept. assessment: by the
    rubric for what was done; None without its head. said: in sentences.
    """

    entry: SessionEntry | None
    assessment: Assessment | None
    said: tuple[str, ...]


def keep_flight(
    record: Path,
    trainee: str = "",
    store: Path | None = None,
    *,
    patient: PatientScene | None = None,
) -> KeptFlight:
    """Score a flight's recording and add it to the progress store.

    trainee: a made-up name, "" for none. store: its file; None for the user's. patient:
    the one that was flown through, as it was before anybody operated; None to load it.
    What goes wrong is said, and costs nothing of the flight: without its head it is
    kept with the metrics of motion alone.
    """
    said: list[str] = []
    assessment = None
    try:
        rubric = fitting_rubric(read_recording(record))
        try:
            found = session_metrics(record, settings=rubric.settings, patient=patient)
            assessment = assessment_of(record, rubric, found)
        except UserError as error:
            said.append(f"Not scored: {error}")
            found = session_metrics(record, has_head=False)
        entry = entry_of_session(
            record, trainee=trainee, metrics=found.metrics, assessment=assessment
        )
        kept = ProgressStore(store)
        kept.add(entry)
    except (UserError, OSError) as error:
        said.append(f"Not kept in paravol progress: {error}")
        return KeptFlight(None, assessment, tuple(said))
    if kept.told:
        said.append(kept.told)
    if assessment is not None:
        said.append(f"Scored by {whole_text(assessment)}")
    said.append("Kept in paravol progress; --no-store leaves a session out.")
    return KeptFlight(entry, assessment, tuple(said))
