"""What a session that was just flown was worth: passed, points, what to practise.

Here the session enters the progress store.
"""

from dataclasses import dataclass
from pathlib import Path

from paravol.debrief.advice import Advice, advice_on
from paravol.patient import PatientScene, Progress, no_progress
from paravol.progress.session_entry import SessionEntry, entry_of_session
from paravol.progress.store import ProgressStore
from paravol.scoring.session_metrics import session_metrics
from paravol.scoring.session_scoring import (
    assessment_of,
    fitting_rubric,
    wanted_metrics,
)
from scenarios import Scenario, Score
from scenarios.bundle import read_recording
from scenarios.metrics import DEFINITIONS, Definition, Metric
from scenarios.metrics.cavity import CAVITY
from scenarios.passing import PassMark, pass_marks
from scenarios.rubrics import Assessment, Rubric
from system import UserError

SLOW = frozenset({"economy of motion", "touched area"})
"""They search the head's air, and step the session again with the names of structures;
so do those of the cavity. `paravol progress add` measures them."""

KEPT = "Kept in your progress."


@dataclass(frozen=True, slots=True)
class ResultOrder:
    """Which session's result is wanted.

    record: its folder. trainee: made-up name of who flew. has_store: it goes into the
    progress store. store: its file, None for the user's. patient: that was flown
    through, None to load it.
    """

    record: Path
    trainee: str = ""
    has_store: bool = True
    store: Path | None = None
    patient: PatientScene | None = None


@dataclass(frozen=True, slots=True)
class SessionResult:
    """What a session was worth.

    has_passed: None where nothing says. marks: what was asked, one by one.
    assessment: every point with its reason. advice: what to practise, the most urgent
    first. kept: a sentence about the progress store; is_kept: the session is in it.
    metrics: that were measured.
    """

    scenario: Scenario
    score: Score
    has_passed: bool | None
    marks: tuple[PassMark, ...]
    assessment: Assessment
    advice: tuple[Advice, ...]
    kept: str = ""
    is_kept: bool = False
    metrics: tuple[Metric, ...] = ()


def result_of_session(
    order: ResultOrder, progress: Progress = no_progress
) -> SessionResult:
    """Score a session and put it into the progress store.

    Its recording is trusted where it can be checked, else it is stepped again. A store
    that cannot be used is told and costs nothing else. UserError where the session
    cannot be read or scored.
    """
    progress("Reading the recording", 0.0)
    recording = read_recording(order.record)
    rubric = fitting_rubric(recording)
    flown = recording.info.exercise()
    found = session_metrics(
        order.record,
        settings=rubric.settings,
        chosen=quick_metrics(flown, rubric),
        progress=progress,
        patient=order.patient,
    )
    assessment = assessment_of(order.record, rubric, found)
    scenario, score = found.scenario, found.score
    assert scenario is not None
    assert score is not None
    entry = entry_of_session(
        order.record,
        trainee=order.trainee,
        metrics=found.metrics,
        assessment=assessment,
    )
    marks = tuple(pass_marks(scenario, entry.tasks, found.metrics))
    kept, is_kept = "This session is left out of your progress.", False
    if order.has_store:
        kept, is_kept = _kept(entry, order.store)
    return SessionResult(
        scenario,
        score,
        entry.has_passed,
        marks,
        assessment,
        tuple(advice_on(score, scenario, assessment)),
        kept,
        is_kept,
        tuple(found.metrics),
    )


def quick_metrics(scenario: Scenario, rubric: Rubric) -> tuple[Definition, ...]:
    """Return what is measured while somebody waits: all but what takes seconds.

    What the exercise's marks or the rubric ask for is measured in any case.
    """
    slow = SLOW | {definition.name for definition in CAVITY}
    asked = {definition.name for definition in wanted_metrics(rubric, scenario)}
    return tuple(d for d in DEFINITIONS if d.name not in slow or d.name in asked)


def _kept(entry: SessionEntry, file: Path | None) -> tuple[str, bool]:
    try:
        store = ProgressStore(file)
        store.add(entry)
    except (UserError, OSError) as error:
        return f"Not kept in your progress: {error}", False
    return f"{store.told} {KEPT}".strip(), True
