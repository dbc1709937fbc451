"""What is kept of one recorded session: no pose, no path of a folder, no person."""

import datetime
import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

import msgspec

from paravol.sessions.recorded_flight import require_as_flown
from scenarios import Scenario, Score
from scenarios.bundle import Recording, read_recording
from scenarios.metrics import Metric
from scenarios.rubrics import Assessment, Verdict, exercise_mark
from scenarios.tasks import TaskState
from system import UserError
from system.typed_record import read_kept

NOBODY = ""
"""Name of whoever gave none."""

LONGEST_NAME = 40

SCORE_ROLE = "score"
"""Role of the figures that a session counted itself, and of the points."""

PERCENT = "percent"
"""Name of the rubric's percent among a session's values."""


class Value(msgspec.Struct, frozen=True):
    """One figure of a session; None where there is none.

    role, name, unit: as in `scenarios.metrics.Metric`. sigma: 1 sigma of the device's
    noise, None where it is unknown. is_noise: a tool held still would have given it.
    """

    role: str
    name: str
    unit: str
    value: float | None
    sigma: float | None = None
    is_noise: bool = False


class PartPoints(msgspec.Struct, frozen=True):
    """The points of one item of a rubric; standing: how it came to them."""

    name: str
    title: str
    points: float
    most_points: float
    standing: str


class Scored(msgspec.Struct, frozen=True):
    """A session's assessment in short.

    percent: None where too little could be scored. sha256: of the rubric.
    """

    rubric: str
    version: int
    sha256: str
    percent: float | None
    percent_sigma: float
    pass_percent: float
    verdict: str
    parts: tuple[PartPoints, ...] = ()


class SessionEntry(msgspec.Struct, frozen=True):
    """What a store keeps of one session.

    trainee: a name that they made up, `NOBODY` for none. sha256: of the bundle. bundle:
    name of its folder, without the way there. exercise, title: name and title of the
    scenario. begun: UTC, ISO 8601. duration_s: of the score's clock. is_complete: the
    recording has its end. has_passed: None where nothing says. tasks: status by name.
    scored: None without a rubric.
    """

    trainee: str
    sha256: str
    bundle: str
    exercise: str
    title: str
    begun: str
    duration_s: float
    is_complete: bool
    has_passed: bool | None
    values: tuple[Value, ...] = ()
    tasks: dict[str, str] = {}
    scored: Scored | None = None

    def value(self, name: str, role: str = "") -> Value | None:
        """Return a figure by name; role "": of whichever has it first."""
        if name == PERCENT and role in ("", SCORE_ROLE):
            if self.scored is None:
                return None
            sigma = self.scored.percent_sigma
            return Value(SCORE_ROLE, PERCENT, "%", self.scored.percent, sigma)
        found = [v for v in self.values if v.name == name and role in ("", v.role)]
        return next((v for v in found if v.value is not None), None)


class _Result(msgspec.Struct):
    """What result.json says; one that was written by hand may lack anything."""

    score: Score


def require_name(name: str) -> str:
    """Return a trainee's name; UserError for one that may tell who they are.

    Letters, digits, spaces, dots, dashes and underlines are allowed: no address.
    """
    if len(name) > LONGEST_NAME or not re.fullmatch(r"[\w .-]*", name):
        raise UserError(
            f"The name {name!r} cannot be taken: make up one of at most "
            f"{LONGEST_NAME} letters, digits, spaces, dots, dashes and underlines; it "
            "need not be yours."
        )
    return name.strip()


def bundle_sha256(folder: Path) -> str:
    """Return the hash of a bundle: of its description and of its stream.

    Notes, pictures and results may come later and do not change it. UserError where
    there is no session.
    """
    whole = hashlib.sha256()
    for name in ("session.json", "stream.mcap"):
        try:
            with (folder / name).open("rb") as file:
                whole.update(hashlib.file_digest(file, "sha256").digest())
        except OSError as error:
            raise UserError(
                f"{folder} is not a session: {name} cannot be read ({error.strerror})."
            ) from error
    return whole.hexdigest()


def entry_of_session(
    folder: Path,
    *,
    trainee: str = NOBODY,
    metrics: Sequence[Metric] = (),
    assessment: Assessment | None = None,
) -> SessionEntry:
    """Return what is kept of a session.

    metrics: of it, where they were computed; else what its result says. assessment: by
    a rubric. UserError where it cannot be read, was changed after the flight, or the
    assessment is another session's.
    """
    trainee = require_name(trainee)
    recording = read_recording(folder)
    require_as_flown(folder, recording)
    name = folder.absolute().name
    if assessment is not None and assessment.session != name:
        raise UserError(
            f"The assessment is of {assessment.session}, not of {name}; score this one."
        )
    scenario = recording.info.exercise()
    score = _score(folder)
    tasks = [] if score is None else score.tasks
    values = [
        Value(m.role, m.name, m.unit, m.value, m.sigma, m.is_noise) for m in metrics
    ]
    # a figure that a metric defines is no other one's
    known = {value.name for value in values}
    if score is not None:
        found = _figures(score)
        values += [v for v in found if v.name not in known]
    return SessionEntry(
        trainee,
        bundle_sha256(folder),
        name,
        scenario.name,
        scenario.title,
        _utc(recording.info.created),
        _duration_s(recording) if score is None else score.duration_s,
        recording.complete,
        has_passed(scenario, tasks, assessment, metrics),
        tuple(values),
        {task.name: str(task.status) for task in tasks},
        None if assessment is None else _scored(assessment),
    )


def has_passed(
    scenario: Scenario,
    tasks: Sequence[TaskState],
    assessment: Assessment | None,
    metrics: Sequence[Metric] = (),
) -> bool | None:
    """Return whether a session was good enough; None where something is open.

    The exercise's own pass mark decides, see `scenarios.rubrics.exercise_mark`: a
    general rubric has thresholds of another exercise. Where an exercise asks for
    nothing the rubric's verdict does; a percent too near to its mark to tell is none
    reached. Where something that is asked for is not known, the answer is open.
    """
    percent = None if assessment is None else assessment.percent
    mark = exercise_mark(scenario, tasks, metrics, percent)
    if assessment is not None and assessment.exercise is not None:
        # of the same session, and of all metrics that it needs
        mark = assessment.exercise
    verdict = Verdict.NO_DATA
    if mark is not None:
        verdict = mark.verdict
    elif assessment is not None:
        verdict = assessment.verdict
    return None if verdict is Verdict.NO_DATA else verdict is Verdict.PASSED


def _score(folder: Path) -> Score | None:
    """Return what a session counted itself; None where it did not get to its end."""
    result = read_kept(folder / "result.json", _Result)
    return None if result is None else result.score


def _figures(score: Score) -> list[Value]:
    figures = [("duration", "s", score.duration_s)]
    if score.operation is not None:
        operation = score.operation
        figures += [
            ("injuries", "count", float(len(operation.injuries))),
            ("blood lost", "ml", operation.bled_ml),
        ]
    return [Value(SCORE_ROLE, name, unit, value) for name, unit, value in figures]


def _scored(assessment: Assessment) -> Scored:
    parts = tuple(
        PartPoints(p.name, p.title, p.points, p.most_points, str(p.standing))
        for p in assessment.parts
    )
    return Scored(
        assessment.rubric,
        assessment.rubric_version,
        assessment.rubric_sha256,
        assessment.percent,
        assessment.percent_sigma,
        assessment.pass_percent,
        str(assessment.verdict),
        parts,
    )


def _duration_s(recording: Recording) -> float:
    times = [record.time_s for record in recording.samples]
    return times[-1] - times[0] if times else 0.0


def _utc(created: str) -> str:
    """Return a time in UTC; UserError for one that is none."""
    try:
        when = datetime.datetime.fromisoformat(created)
    except ValueError as error:
        raise UserError(
            f"The session says that it was made at {created!r}, which is no time; "
            "its session.json was changed."
        ) from error
    if when.tzinfo is None:
        when = when.replace(tzinfo=datetime.UTC)
    return when.astimezone(datetime.UTC).isoformat(timespec="seconds")
