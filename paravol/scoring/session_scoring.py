"""Score recorded sessions by a rubric: one, or a folder of hundreds."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from functools import partial
from pathlib import Path

import msgspec
from xxhash import xxh3_128

from paravol.patient import PatientScene, Progress, load_patient, no_progress
from paravol.scoring.session_metrics import (
    PatientSource,
    SessionMetrics,
    session_metrics,
)
from paravol.sessions.recorded_flight import ChangedStreamError
from paravol.sessions.session_store import SUFFIX, Described
from paravol.versions import versions
from scenarios import Scenario
from scenarios.bundle import EditRecord, Recording, read_recording, write_json
from scenarios.metrics import DEFINITIONS, Definition
from scenarios.passing import limited_metrics
from scenarios.rubrics import (
    Assessment,
    Evidence,
    Rubric,
    assess,
    bundled_populations,
    load_rubric,
    population_of,
)
from scenarios.rubrics.rubric import shipped_rubrics
from scenarios.tasks import TaskState
from scenarios.tasks.task import Inject, Open, Remove
from system import UserError
from system.typed_record import read_kept

SCORING_VERSION = 4
"""Grows when the same session and rubric may get other points."""

_PARTS = "session.json", "stream.mcap", "result.json"


class Scored(msgspec.Struct, frozen=True):
    """One session's line: its assessment, or why there is none.

    session: its place below the folder. key: of the bundle, the rubric and the program;
    the same key needs no scoring again. source: see `SessionMetrics`. exercise,
    recorded: its name, and when it was flown.
    """

    session: str
    key: str
    assessment: Assessment | None = None
    problem: str = ""
    source: str = ""
    exercise: str = ""
    recorded: str = ""

    def told(self, folder: Path) -> "Scored":
        """Return the line with what a session's folder says of it."""
        info = read_kept(folder / "session.json", Described)
        if info is None:
            return self
        return msgspec.structs.replace(
            self, exercise=info.scenario_name, recorded=info.created
        )


class BatchOrder(msgspec.Struct, frozen=True):
    """How sessions are scored. Travels to other processes.

    rubric: None takes for each session the bundled one for what was done in it. case:
    where the case that was flown through lies now, "" as recorded. exact: step every
    session again instead of trusting its recording.
    """

    rubric: Rubric | None
    out: Path
    arm: str = ""
    case: str = ""
    exact: bool = False


def fitting_rubric(recording: Recording) -> Rubric:
    """Return the bundled rubric for what was to be done, and for what was."""
    has_cuts = any(isinstance(record, EditRecord) for record in recording.records)
    return rubric_for(recording.info.exercise(), has_cuts=has_cuts)


def rubric_for(scenario: Scenario, *, has_cuts: bool) -> Rubric:
    """Return the bundled rubric of an exercise: to cut, or to look.

    An operation of which nothing was done is judged as one, and so is a cut that nobody
    asked for.
    """
    is_operation = bool(scenario.tools) or any(
        isinstance(task, Remove | Open | Inject) for task in scenario.tasks
    )
    name = "operation" if is_operation or has_cuts else "endoscopy"
    return load_rubric(name).fitted(scenario)


def wanted_metrics(rubric: Rubric, scenario: Scenario) -> tuple[Definition, ...]:
    """Return what a rubric and an exercise's own pass mark read."""
    names = {source.metric for source in (*rubric.items, *rubric.fails)}
    names |= {definition.name for definition in limited_metrics(scenario)}
    if rubric.least_path_mm > 0.0:
        names.add("path length")
    return tuple(d for d in DEFINITIONS if d.name in names)


def score_session(
    folder: Path,
    rubric: Rubric,
    *,
    arm: str = "",
    case: Path | None = None,
    exact: bool = False,
    progress: Progress = no_progress,
    patient: PatientScene | PatientSource | None = None,
) -> tuple[Assessment, SessionMetrics]:
    """Score one recorded session; return also the metrics behind it.

    exact: step it again; else its recording is trusted where it can be checked. The
    other arguments and errors are those of `session_metrics`.
    """
    found = session_metrics(
        folder,
        settings=rubric.settings,
        chosen=partial(wanted_metrics, rubric),
        arm=arm,
        case=case,
        progress=progress,
        patient=patient,
        exact=exact,
    )
    return assessment_of(folder, rubric, found), found


def assessment_of(folder: Path, rubric: Rubric, found: SessionMetrics) -> Assessment:
    """Score a session that is measured already, under the rubric's settings.

    Bands are those of the bundled population, which is there for some exercises.
    """
    score, scenario = found.score, found.scenario
    assert score is not None
    assert scenario is not None
    evidence = Evidence(
        Path(folder).resolve().name,
        scenario.name,
        found.metrics,
        found.span,
        _in_session_time(score.tasks, found),
        frozenset(t.name for t in scenario.tasks if isinstance(t, Remove | Open)),
        score.operation,
        found.is_complete,
        exercise=scenario,
    )
    return assess(rubric, evidence, population_of(scenario.name))


def _in_session_time(
    tasks: Sequence[TaskState], found: SessionMetrics
) -> list[TaskState]:
    """Return tasks whose times are the session's, not those of the score's clock."""

    def session_s(clock_s: float | None) -> float | None:
        if clock_s is None:
            return None
        for begin, end in found.frozen:
            if clock_s > begin:
                clock_s += end - begin
        return clock_s

    return [
        replace(
            task, opened_s=session_s(task.opened_s), ended_s=session_s(task.ended_s)
        )
        for task in tasks
    ]


def sessions_in(folder: Path) -> list[Path]:
    """Return the session itself, or all sessions below a folder, in order.

    UserError where there are none. A half-written one is among them.
    """
    if not folder.is_dir():
        raise UserError(f"{folder} is no folder.")
    if folder.suffix == SUFFIX or (folder / _PARTS[0]).exists():
        return [folder]
    found = sorted(path for path in folder.rglob(f"*{SUFFIX}") if path.is_dir())
    if not found:
        raise UserError(
            f"There is no session in {folder}; sessions are folders NAME{SUFFIX}."
        )
    return found


def scoring_key(session: Path, order: BatchOrder) -> str:
    """Return a hash of all that a score depends on: bundle, rubric, program."""
    digest = xxh3_128(f"{SCORING_VERSION} {versions()}".encode())
    rubrics = [order.rubric] if order.rubric else map(load_rubric, shipped_rubrics())
    for rubric in rubrics:
        digest.update(rubric.sha256().encode())
    digest.update(f"{order.arm} {order.case} {order.exact}".encode())
    for population in bundled_populations().values():
        digest.update(population.read_bytes())
    for name in _PARTS:
        digest.update(f"/{name}/".encode())
        try:
            with open(session / name, "rb") as file:
                while block := file.read(1 << 20):
                    digest.update(block)
        except OSError as error:
            digest.update(f"absent {error.errno}".encode())
    return digest.hexdigest()


def kept_file(session: str, order: BatchOrder) -> Path:
    """Return where a session's line is kept."""
    name = session.removesuffix(SUFFIX).replace("/", "__") or "session"
    rubric = "usual"
    if order.rubric is not None:
        rubric = f"{order.rubric.name}-{order.rubric.version}"
    return order.out / f"{name}.{rubric}.assessment.json"


def kept_line(session: str, key: str, order: BatchOrder) -> Scored | None:
    """Return what an earlier run found for the same key; None where there is nothing.

    A file that cannot be read counts as none: it is written anew.
    """
    line = read_kept(kept_file(session, order), Scored)
    is_same = line is not None and (line.key, line.session) == (key, session)
    return line if is_same else None


_patients: dict[bytes, PatientScene] = {}
"""The newest head that this process has loaded: sessions of one exercise share it."""


def patient_of(scenario: Scenario) -> PatientScene:
    """Return the head of a scenario, loaded once for its sessions."""
    key = msgspec.json.encode(scenario.head)
    if key not in _patients:
        _patients.clear()
        _patients[key] = load_patient(scenario, no_progress)
    return _patients[key]


def score_line(folder: Path, session: str, order: BatchOrder) -> Scored:
    """Score one session of a batch and keep its line; never raises for its content.

    folder: of the session. session: its name in the table.
    """
    key = ""
    try:
        key = scoring_key(folder, order)
        case = Path(order.case) if order.case else None
        rubric = order.rubric or fitting_rubric(read_recording(folder))
        assessment, found = score_session(
            folder,
            rubric,
            arm=order.arm,
            case=case,
            exact=order.exact,
            patient=patient_of,
        )
        line = Scored(session, key, assessment, source=found.source)
    except ChangedStreamError as error:
        line = Scored(session, key, problem=f"changed: {error}")
    except UserError as error:
        line = Scored(session, key, problem=str(error))
    except Exception as error:
        # one session must not end a night of scoring; its line says what broke
        line = Scored(session, key, problem=f"{type(error).__name__}: {error}")
    line = line.told(folder)
    if key:
        write_json(kept_file(session, order), line)
    return line


def score_all(
    folder: Path, order: BatchOrder, executor: Executor | None
) -> Iterator[Scored]:
    """Yield the lines of all sessions as they are done.

    executor: of processes or MPI ranks; None scores here, one after the other. Where a
    process dies, the sessions it had not finished say so.
    """
    sessions = sessions_in(folder)
    order.out.mkdir(parents=True, exist_ok=True)
    names = [
        path.relative_to(folder).as_posix() if path != folder else path.name
        for path in sessions
    ]
    left = []
    for path, name in zip(sessions, names, strict=True):
        kept = kept_line(name, scoring_key(path, order), order)
        if kept is None:
            left.append((path, name))
        else:
            # lines of before did not say
            yield kept.told(path)
    if executor is None:
        for path, name in left:
            yield score_line(path, name, order)
        return
    waiting: dict[Future[Scored], str] = {
        executor.submit(score_line, path, name, order): name for path, name in left
    }
    for done in as_completed(waiting):
        try:
            yield done.result()
        except (BrokenProcessPool, OSError) as error:
            yield Scored(
                waiting[done],
                "",
                problem=f"the process that scored it ended: {error} Start again; what "
                "is done is kept.",
            )
