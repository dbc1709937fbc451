"""`paravol score` and `paravol pass-mark`: score, print, write tables."""

from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from app.cli.root import Flag, Json
from app.cli.terminal import ProgressReporter, print_json, print_table
from paravol.scoring.scoring_executors import scoring_executor
from system import UserError, require_place, whole_file
from system.csv_table import CsvTable

if TYPE_CHECKING:
    from paravol.scoring.session_scoring import BatchOrder, Scored
    from scenarios.rubrics import Assessment, PassMark, RubricPart
    from scenarios.rubrics.rubric import Rubric

OUT = "assessments"
"""Folder beside the sessions in which scores are kept."""


Jobs = Annotated[
    int,
    Parameter(help="Processes that work at once.", validator=Number(gte=1, lte=256)),
]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class ScoreOptions:
    """Options of a scoring, as they were typed.

    Parameters
    ----------
    rubric
        Name of a bundled rubric (endoscopy, operation), or a .toml file of your own;
        for each session by itself "operation" or, where nothing was cut, "endoscopy".
    out
        Where scores are kept; a folder "assessments" beside the sessions otherwise.
    mpi
        Score by the ranks of: mpiexec -n N python -m mpi4py.futures -m app score ...
    csv
        Write a table with a row for each session.
    json_file
        Write all assessments.
    arm
        Profile of the arm that was used, such as dx: noise from its counts.
    case
        Where the case that was flown through lies now.
    exact
        Step every session again instead of trusting what its recording says.
    """

    rubric: str = ""
    out: Path | None = None
    jobs: Jobs = 1
    mpi: Flag = False
    csv: Path | None = None
    json_file: Path | None = None
    arm: str = ""
    case: Path | None = None
    exact: Flag = False


def score(
    sessions: Path, *, options: ScoreOptions = ScoreOptions(), json: Json = False
) -> int:
    """Score recorded sessions by a rubric; every point says what it came from.

    Of one session every part is told with its value, thresholds and seconds; of a
    folder one line a session. What was scored before is not scored again.

    Parameters
    ----------
    sessions
        A folder NAME.paravol, or a folder of such folders.
    """
    from paravol.scoring.session_scoring import BatchOrder
    from scenarios.bundle import write_json
    from scenarios.rubrics import load_rubric

    for file in (options.csv, options.json_file):
        if file is not None:
            require_place(file)
    rubric = load_rubric(options.rubric) if options.rubric else None
    order = BatchOrder(
        rubric,
        _out(sessions, options.out),
        options.arm,
        "" if options.case is None else str(options.case),
        options.exact,
    )
    lines = _lines(sessions, order, options.jobs, mpi=options.mpi)
    if options.csv is not None:
        with whole_file(options.csv) as beside:
            beside.write_text(as_csv(lines, rubric), "utf-8")
    if options.json_file is not None:
        write_json(options.json_file, lines)
    if json:
        print_json(lines)
    elif len(lines) == 1 and lines[0].assessment is not None:
        print_assessment(lines[0].assessment, lines[0].source)
    else:
        title = "Scores, each session by the rubric for what was done"
        if rubric is not None:
            title = f"{rubric.title} ({rubric.name} {rubric.version})"
        print_table(title, [(line.session, line_text(line)) for line in lines])
    return 1 if any(line.assessment is None for line in lines) else 0


def _out(sessions: Path, out: Path | None) -> Path:
    if out is not None:
        return out
    is_one = sessions.suffix == ".paravol" or (sessions / "session.json").exists()
    return (sessions.parent if is_one else sessions) / OUT


def _lines(
    sessions: Path, order: "BatchOrder", jobs: int, *, mpi: bool
) -> "list[Scored]":
    from paravol.scoring.session_scoring import score_all, sessions_in

    count = len(sessions_in(sessions))
    found: list[Scored] = []
    with (
        ProgressReporter() as stages,
        scoring_executor(min(jobs, count), mpi=mpi) as executor,
    ):
        stages("Scoring", 0.0)
        for line in score_all(sessions, order, executor):
            found.append(line)
            stages("Scoring", len(found) / count)
            if line.problem:
                stages.say(f"{line.session}: {line.problem}")
    return sorted(found, key=lambda line: line.session)


def line_text(line: "Scored") -> str:
    """Return a session's total, or why it has none."""
    from paravol.scoring.verdict_texts import whole_text

    found = line.assessment
    if found is None:
        return line.problem
    # that a recording could not be trusted is told wherever its score is
    doubt = f"; {line.source}" if line.source not in ("", "recorded") else ""
    return whole_text(found) + doubt


def print_assessment(assessment: "Assessment", source: str) -> None:
    """Print each part with its points, value, thresholds and moments."""
    from paravol.scoring.verdict_texts import points_text, verdict_text

    rows = [("verdict", verdict_text(assessment)), ("total", points_text(assessment))]
    rows += [
        (f"hard fail: {f.name}", f.why + _when(f.intervals)) for f in assessment.fails
    ]
    greyed = frozenset(
        len(rows) + place
        for place, part in enumerate(assessment.parts)
        if not part.counts
    )
    rows += [(part.title, part_text(part)) for part in assessment.parts]
    rows += [("remark", remark) for remark in assessment.remarks]
    rows.append(("measured", source))
    title = f"{assessment.session} by {assessment.rubric} {assessment.rubric_version}"
    print_table(title, rows, greyed)


def part_text(part: "RubricPart") -> str:
    """Return a part's points and all that they came from."""
    from paravol.scoring.verdict_texts import points_figure
    from scenarios.metrics.value_text import value_text

    if not part.counts:
        why = part.reason.removeprefix("not enough data: ")
        text = f"- of {part.most_points:g}: {part.standing}"
        return text + (f": {why}" if why else "")
    value = part.reason
    if part.value is not None:
        value = value_text(part.value, part.sigma, part.unit)
    points = points_figure(part.points, part.points_sigma)
    knots = ", ".join(f"{at:g}: {percent:g} %" for at, percent in part.thresholds)
    text = f"{points} of {part.most_points:g}: {part.source} {value}"
    text += f" ({knots})" + _when(part.intervals)
    text += f"; {part.withheld}" if part.withheld else ""
    for band in part.bands:
        text += f"; {band.group} {value_text(band.low)} to {value_text(band.high)}"
    text += f"; {part.bands[0].source}" if part.bands else ""
    return text + (f"; {part.why}" if part.why else "")


def _when(intervals: tuple[tuple[float, float], ...]) -> str:
    if not intervals:
        return ""
    told = [
        f"{begin:.1f}" if begin == end else f"{begin:.1f}-{end:.1f}"
        for begin, end in intervals[:3]
    ]
    more = f" and {len(intervals) - 3} more" if len(intervals) > 3 else ""
    return f" at {', '.join(told)} s{more}"


def as_csv(lines: "list[Scored]", rubric: "Rubric | None") -> str:
    """Return a row a session: total, verdict, points of each item, problem.

    rubric: None where each session had its own: then a column names its rubric, too.
    """
    text = StringIO()
    table = CsvTable(text)
    if rubric is not None:
        items = [item.name for item in rubric.items]
    else:
        told = [line.assessment for line in lines if line.assessment is not None]
        items = list(dict.fromkeys(_item(a, part) for a in told for part in a.parts))
    head = ["Session", "Percent", "Sigma", "Verdict", "Exercise", "HardFails"]
    head += ["Problem", "ExerciseName", "Recorded", "Rubric", "RubricVersion"]
    table.add([*head, "Remarks", "Measured", *items])
    for line in lines:
        found = line.assessment
        flown = [line.exercise, line.recorded]
        if found is None:
            row = [line.session, *[""] * 5, line.problem, *flown]
            table.add(row + [""] * (4 + len(items)))
            continue
        percent = "" if found.percent is None else repr(found.percent)
        fails = ";".join(fail.name for fail in found.fails)
        row = [line.session, percent, repr(found.percent_sigma), str(found.verdict)]
        row.append("" if found.exercise is None else str(found.exercise.verdict))
        own = [found.rubric, str(found.rubric_version), " ".join(found.remarks)]
        points = {
            p.name if rubric is not None else _item(found, p): repr(p.points)
            for p in found.parts
            if p.counts
        }
        row += [fails, "", *flown, *own, line.source]
        table.add([*row, *(points.get(item, "") for item in items)])
    return text.getvalue()


def _item(assessment: "Assessment", part: "RubricPart") -> str:
    """Name an item among those of several rubrics."""
    return f"{assessment.rubric} {assessment.rubric_version}: {part.name}"


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class PassMarkOptions:
    """Options of a pass mark, as they were typed.

    Parameters
    ----------
    metric
        Full name of a metric, such as "path length" or "smallest distance: orbit".
    role
        Whose, where several have the metric, such as scope.
    rubric
        A rubric whose total the mark is for.
    """

    metric: str = ""
    role: str = ""
    rubric: str = ""
    jobs: Jobs = 1


def pass_mark(
    novices: Path,
    experts: Path,
    *,
    options: PassMarkOptions = PassMarkOptions(),
    json: Json = False,
) -> int:
    """Set a pass mark by two groups: who cannot do it yet, and who can.

    The contrasting-groups method: the mark lies where both groups' normal densities
    are equal. Its confidence comes of drawing the groups anew.

    Parameters
    ----------
    novices
        Folder of sessions of those who cannot do it yet.
    experts
        Folder of sessions of those who can.
    """
    from paravol.scoring.session_scoring import BatchOrder
    from scenarios import rubrics

    if bool(options.metric) == bool(options.rubric):
        raise UserError("Name either a metric with --metric or a rubric with --rubric.")
    groups = []
    for folder in (novices, experts):
        if options.rubric:
            order = BatchOrder(rubrics.load_rubric(options.rubric), _out(folder, None))
            lines = _lines(folder, order, options.jobs, mpi=False)
            values = [
                line.assessment.percent
                for line in lines
                if line.assessment is not None and line.assessment.percent is not None
            ]
            groups.append((values, len(lines) - len(values)))
        else:
            groups.append(_metric_values(folder, options.metric, options.role))
    (beginners, left), (masters, right) = groups
    mark = rubrics.pass_mark(beginners, masters)
    if json:
        print_json(mark)
    else:
        what = options.metric or f"percent by {options.rubric}"
        print_table(f"Pass mark: {what}", _mark_rows(mark, left, right))
    return 0


def _metric_values(folder: Path, name: str, role: str) -> tuple[list[float], int]:
    """Return a metric's values over sessions, and how many had none."""
    from paravol.scoring.session_metrics import session_metrics
    from paravol.scoring.session_scoring import patient_of, sessions_in
    from scenarios.metrics import definitions_named

    family = name.partition(": ")[0]
    chosen = definitions_named((family,))
    values: list[float] = []
    sessions = sessions_in(folder)
    with ProgressReporter() as stages:
        for place, session in enumerate(sessions):
            try:
                found = session_metrics(session, chosen=chosen, patient=patient_of)
            except UserError as error:
                stages.say(f"{session.name}: {error}")
                continue
            named = [
                m
                for m in found.metrics
                if m.name == name and (not role or m.role == role)
            ]
            if len(named) > 1:
                roles = " or ".join(repr(m.role) for m in named)
                raise UserError(f"Say with --role whose {name!r} is meant: {roles}.")
            if named and named[0].value is not None:
                values.append(named[0].value)
            stages(f"Measuring {folder.name}", (place + 1) / len(sessions))
    return values, len(sessions) - len(values)


def _mark_rows(mark: "PassMark", left: int, right: int) -> list[tuple[str, str]]:
    from scenarios.metrics.value_text import value_text

    side = "at least" if mark.passes_above else "at most"
    novices, experts = mark.novices, mark.experts
    rows = [
        ("pass", f"{side} {value_text(mark.mark)}"),
        (
            "95 % of draws",
            f"{value_text(mark.low)} to {value_text(mark.high)}, of {mark.draws} draws",
        ),
        (
            "novices",
            f"{value_text(novices.mean, novices.deviation)}, {novices.count} sessions",
        ),
        (
            "experts",
            f"{value_text(experts.mean, experts.deviation)}, {experts.count} sessions",
        ),
        (
            "novices that pass",
            f"{mark.false_pass:.1%} expected, {mark.observed_false_pass:.1%} counted",
        ),
        (
            "experts that fail",
            f"{mark.false_fail:.1%} expected, {mark.observed_false_fail:.1%} counted",
        ),
    ]
    if left or right:
        rows.append(("without a value", f"{left} novices, {right} experts"))
    rows += [("remark", remark) for remark in mark.remarks]
    return rows
