"""`paravol progress`: read the store, print, draw, export, delete."""

import shutil
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from app.cli.root import Flag, Json
from app.cli.terminal import ProgressReporter, print_json, print_table
from paravol.sessions.session_store import SUFFIX, SessionStore
from system import UserError, require_place, whole_file
from system.typed_record import decode_json

if TYPE_CHECKING:
    from paravol.progress.cohort import Standing
    from paravol.progress.learning_curve import LearningCurve
    from paravol.progress.session_entry import SessionEntry
    from paravol.progress.store import ProgressStore
    from scenarios.metrics import Metric
    from scenarios.rubrics import Assessment

DURATION = "duration"
"""The figure of whoever has no rubric's percent."""

ROLES = ("scope", "tool", "both hands", "patient", "score")

SHORTEST_HASH = 6


progress = App(
    name="progress",
    help="Follow progress over time: learning curves, a cohort, exports.",
)
Store = Annotated[
    Path | None,
    Parameter(help="The store's file; the user's own when left out."),
]
Trainee = Annotated[
    str | None,
    Parameter(help='Only of this made-up name; "" is whoever gave none.'),
]
Exercise = Annotated[str | None, Parameter(help="Only of this exercise.")]
Figure = Annotated[
    str,
    Parameter(
        help="Name of a metric, or percent for the rubric's points; the role may "
        "stand before it, as in scope:path length."
    ),
]


def open_store(file: Path | None) -> "ProgressStore":
    """Open a store and say what there is to say of that."""
    from paravol.progress.store import ProgressStore

    store = ProgressStore(file)
    if store.told:
        print(store.told, file=sys.stderr)
    return store


@progress.default
def show(
    *,
    trainee: Trainee = None,
    figure: Figure = "",
    store: Store = None,
    json: Json = False,
) -> int:
    """Tell how each exercise goes: attempts, passes, best, what the next may give."""
    from paravol.progress.cohort import standings
    from paravol.progress.learning_curve import fit_learning_curve

    entries = open_store(store).sessions(trainee=trainee)
    rows: list[dict[str, object]] = []
    lines: list[tuple[str, str]] = []
    for exercise in dict.fromkeys(entry.exercise for entry in entries):
        flown = [entry for entry in entries if entry.exercise == exercise]
        for name in dict.fromkeys(entry.trainee for entry in flown):
            own = [entry for entry in flown if entry.trainee == name]
            role, wanted = _figure(figure, own)
            (standing,) = standings(own, wanted, role)
            figures = _figures(own, wanted, role)
            curve = fit_learning_curve(figures)
            rows.append(
                {**asdict(standing), "figure": wanted, "curve": _curve_report(curve)}
            )
            head = f"{exercise}{_by(name)}"
            lines.append((head, _standing_text(standing, wanted, curve)))
    if json:
        print_json(rows)
    else:
        print_table("Progress", lines or [("sessions", "none are kept yet")])
    return 0


progress.command(show)


@progress.command(name="list")
def list_sessions(
    *,
    trainee: Trainee = None,
    exercise: Exercise = None,
    store: Store = None,
    json: Json = False,
) -> int:
    """List the sessions that are kept, the oldest first."""
    from paravol.progress.session_entry import PERCENT

    entries = open_store(store).sessions(trainee=trainee, exercise=exercise)
    if json:
        print_json(entries)
        return 0
    answers = {True: "passed", False: "not passed", None: "not judged"}
    rows = []
    for entry in entries:
        percent = entry.value(PERCENT)
        points = "" if percent is None or percent.value is None else percent.value
        told = [
            f"{entry.exercise}{_by(entry.trainee)}",
            f"{entry.duration_s:.1f} s",
            answers[entry.has_passed],
            *([f"{points:.0f} %"] if points != "" else []),
            entry.bundle,
            entry.sha256[:12],
        ]
        rows.append((entry.begun[:16].replace("T", " "), ", ".join(told)))
    print_table("Sessions (UTC)", rows or [("sessions", "none are kept yet")])
    return 0


@progress.command
def curve(
    exercise: str,
    *,
    figure: Figure = "",
    trainee: str = "",
    out: Path | None = None,
    store: Store = None,
    json: Json = False,
) -> int:
    """Fit a learning curve to a trainee's attempts at an exercise.

    Parameters
    ----------
    exercise
        Its name, as listed.
    trainee
        The made-up name; without it, whoever gave none.
    out
        Draw it into this .png or .svg file.
    """
    from paravol.progress.curve_plot import draw_curve, require_format
    from paravol.progress.learning_curve import fit_learning_curve, moving_pass_rate

    if out is not None:
        require_format(out)
        require_place(out)
    kept = open_store(store)
    entries = kept.sessions(trainee=trainee, exercise=exercise)
    if not entries:
        raise UserError(
            f"There is no session of {exercise!r}{_by(trainee)}; paravol progress list "
            "has those that there are."
        )
    role, wanted = _figure(figure, entries)
    figures = _figures(entries, wanted, role)
    curve = fit_learning_curve(figures)
    rates = moving_pass_rate(kept.results(trainee).get(exercise, []))
    units = [v.unit for e in entries if (v := e.value(wanted, role)) is not None]
    unit = units[0] if units else ""
    if out is not None:
        title = f"{entries[0].title or exercise}{_by(trainee)}"
        label = wanted if unit in ("", "1") else f"{wanted}, {unit}"
        fitted = None if isinstance(curve, str) else curve
        draw_curve(out, title, label, figures, fitted, rates)
    if json:
        report = {"exercise": exercise, "figure": wanted, "unit": unit}
        told = {"attempts": figures, "curve": _curve_report(curve)}
        print_json({**report, **told, "pass_rate": [asdict(rate) for rate in rates]})
        return 0
    rows = [("attempts", str(len(figures))), *_curve_rows(curve, unit)]
    if rates:
        last = rates[-1]
        rows.append(
            (
                "passed lately",
                f"{100 * last.share:.0f} % ({100 * last.low:.0f} to "
                f"{100 * last.high:.0f} % with 90 % confidence)",
            )
        )
    if out is not None:
        rows.append(("picture", str(out)))
    print_table(f"{exercise}{_by(trainee)}: {wanted}", rows)
    return 0


@progress.command
def cohort(
    *,
    figure: Figure = "",
    exercise: Exercise = None,
    store: Store = None,
    json: Json = False,
) -> int:
    """Set all trainees beside one another: median, best, passes, percentile."""
    from paravol.progress.cohort import standings

    entries = open_store(store).sessions(exercise=exercise)
    role, wanted = _figure(figure, entries)
    rows = standings(entries, wanted, role)
    if json:
        print_json([asdict(row) for row in rows])
        return 0
    lines = [(f"{row.exercise}{_by(row.trainee)}", _cohort_text(row)) for row in rows]
    print_table(f"Cohort: {wanted}", lines or [("sessions", "none are kept yet")])
    return 0


@progress.command
def export(
    *,
    csv: Path | None = None,
    xapi: Path | None = None,
    home_page: str = "",
    trainee: Trainee = None,
    exercise: Exercise = None,
    store: Store = None,
) -> int:
    """Write sessions as a table, or as statements for a learning record store.

    Parameters
    ----------
    csv
        Write a row for each figure of each session.
    xapi
        Write xAPI 1.0.3 statements as one JSON array.
    home_page
        With --xapi: URL of whoever gave out the names, such as your school's.
    """
    from paravol.progress.csv_export import as_csv
    from paravol.progress.xapi import HOME_PAGE, statements
    from scenarios.bundle import write_json

    if csv is None and xapi is None:
        raise UserError("Name a file: --csv FILE, --xapi FILE or both.")
    for place in (csv, xapi):
        if place is not None:
            require_place(place)
    entries = open_store(store).sessions(trainee=trainee, exercise=exercise)
    if csv is not None:
        with whole_file(csv) as beside:
            beside.write_text(as_csv(entries), "utf-8", newline="")
        print(f"Wrote {len(entries)} sessions to {csv}.")
    if xapi is not None:
        write_json(xapi, statements(entries, home_page or HOME_PAGE))
        print(f"Wrote {len(entries)} statements to {xapi}.")
    return 0


@progress.command
def add(
    *sessions: Path,
    trainee: str = "",
    rubric: str = "",
    assessment: Path | None = None,
    motion_only: Flag = False,
    store: Store = None,
    json: Json = False,
) -> int:
    """Add recorded sessions; one that is there already is replaced.

    Parameters
    ----------
    sessions
        Folders NAME.paravol.
    trainee
        A name that the trainee made up. None is needed.
    rubric
        Score them by this bundled rubric, such as endoscopy, or a .toml file; by
        itself "operation" or, where nothing was cut, "endoscopy".
    assessment
        JSON file of the session's assessment by a rubric; for one session only.
    motion_only
        Leave the head out: no contact, hazards, removal or score, but at once.
    """
    from paravol.progress.session_entry import entry_of_session, require_name
    from paravol.scoring.session_metrics import session_metrics
    from paravol.scoring.session_scoring import fitting_rubric, score_session
    from scenarios.bundle import read_recording
    from scenarios.rubrics import load_rubric

    if not sessions:
        raise UserError("Name at least one session, a folder NAME.paravol.")
    if assessment is not None and (len(sessions) != 1 or rubric):
        raise UserError("--assessment goes with one session, without --rubric.")
    named = load_rubric(rubric) if rubric else None
    require_name(trainee)
    scored = None
    if assessment is not None:
        scored = _read_assessment(assessment)
    kept = open_store(store)
    added = []
    for folder in sessions:
        with ProgressReporter(quiet=json) as stages:
            metrics: list[Metric] = session_metrics(
                folder, has_head=not motion_only, progress=stages
            ).metrics
            if assessment is None and (named is not None or not motion_only):
                chosen = named or fitting_rubric(read_recording(folder))
                scored, _ = score_session(folder, chosen, progress=stages)
        entry = entry_of_session(
            folder, trainee=trainee, metrics=metrics, assessment=scored
        )
        is_new = kept.add(entry)
        added.append({"session": entry.bundle, "sha256": entry.sha256, "new": is_new})
        if not json:
            print(f"{'Added' if is_new else 'Replaced'} {entry.bundle}.")
    if json:
        print_json(added)
    return 0


@progress.command
def delete(
    *sessions: str,
    trainee: Trainee = None,
    everything: Flag = False,
    recordings: Flag = False,
    recordings_in: tuple[Path, ...] = (),
    yes: Flag = False,
    store: Store = None,
) -> int:
    """Delete sessions for good; without --yes only say which.

    Parameters
    ----------
    sessions
        Names of recordings or beginnings of hashes, as listed.
    trainee
        All sessions of this name, and the name.
    everything
        All sessions of everybody.
    recordings
        Delete the recordings, too, where they lie below the user's data directory.
    recordings_in
        Delete them in this folder, too; may be given several times.
    yes
        Really delete.
    """
    kept = open_store(store)
    chosen = _chosen(kept.sessions(), sessions, trainee, everything=everything)
    places = list(recordings_in)
    if recordings:
        places.append(SessionStore.of_the_user().folder)
    folders = _recordings({entry.sha256 for entry in chosen}, places)
    for entry in chosen:
        print(f"{entry.bundle} of {entry.begun[:10]}{_by(entry.trainee)}")
    for folder in folders:
        print(f"the recording {folder}")
    if not yes:
        print(f"{len(chosen)} sessions would go; --yes deletes them for good.")
        return 0
    # recordings first: as long as the store knows them, this can be done again
    for folder in folders:
        shutil.rmtree(folder)
    count = kept.delete([entry.sha256 for entry in chosen])
    print(f"Deleted {count} sessions and {len(folders)} recordings.")
    return 0


def _chosen(
    entries: "list[SessionEntry]",
    names: Sequence[str],
    trainee: str | None,
    *,
    everything: bool,
) -> "list[SessionEntry]":
    ways = (names, trainee is not None, everything)
    if sum(map(bool, ways)) != 1:
        raise UserError("Say which: names of sessions, --trainee or --everything.")
    if everything:
        return entries
    if trainee is not None:
        return [entry for entry in entries if entry.trainee == trainee]
    found: dict[str, SessionEntry] = {}
    for word in names:
        is_hash = len(word) >= SHORTEST_HASH
        own = [
            entry
            for entry in entries
            if entry.bundle in (word, f"{word}{SUFFIX}")
            or (is_hash and entry.sha256.startswith(word))
        ]
        if not own:
            raise UserError(
                f"No session is called {word!r}; paravol progress list has their names "
                "and hashes."
            )
        if len(own) > 1:
            raise UserError(
                f"{len(own)} sessions are called {word!r}; say which by its hash."
            )
        found |= {entry.sha256: entry for entry in own}
    return list(found.values())


def _recordings(hashes: set[str], places: Sequence[Path]) -> list[Path]:
    """Return the bundles of these hashes in some folders."""
    from paravol.progress.session_entry import bundle_sha256

    found = []
    for place in places:
        for folder in sorted(place.glob(f"*{SUFFIX}")):
            if folder.is_symlink() or not (folder / "stream.mcap").is_file():
                continue
            if bundle_sha256(folder) in hashes:
                found.append(folder)
    return found


def _read_assessment(file: Path) -> "Assessment":
    from scenarios.rubrics import Assessment

    try:
        content = file.read_bytes()
    except OSError as error:
        raise UserError(f"{file} cannot be read: {error.strerror}.") from error
    return decode_json(content, Assessment, file, "an assessment")


def _figure(asked: str, entries: "Sequence[SessionEntry]") -> tuple[str, str]:
    """Return role and name of a figure; by itself the percent, or the duration."""
    from paravol.progress.session_entry import PERCENT

    if not asked:
        has_percent = any(entry.value(PERCENT) is not None for entry in entries)
        return "", PERCENT if has_percent else DURATION
    head, colon, rest = asked.partition(":")
    role, name = (head, rest) if colon and head in ROLES else ("", asked)
    if entries and all(entry.value(name, role) is None for entry in entries):
        known = sorted({v.name for e in entries for v in e.values})
        raise UserError(
            f"No session has the figure {asked!r}; known are: {'; '.join(known)}."
        )
    return role, name


def _figures(entries: "Sequence[SessionEntry]", name: str, role: str) -> list[float]:
    """Return the figures of the attempts that have one, in order of time."""
    found = [entry.value(name, role) for entry in entries]
    return [v.value for v in found if v is not None and v.value is not None]


def _by(trainee: str) -> str:
    return f" by {trainee}" if trainee else ""


def _standing_text(row: "Standing", figure: str, curve: "LearningCurve | str") -> str:
    from scenarios.metrics.value_text import value_text

    unit = "" if row.unit in ("", "1") else f" {row.unit}"
    told = [f"{row.attempts} attempts", f"{row.passes} of {row.judged} passed"]
    if row.best is not None:
        told.append(f"{figure}: best {value_text(row.best)}{unit}")
    if not isinstance(curve, str):
        told.append(
            f"the next may give {value_text(curve.middle[-1])} "
            f"({value_text(curve.low[-1])} to {value_text(curve.high[-1])}){unit}"
        )
    return ", ".join(told)


def _cohort_text(row: "Standing") -> str:
    from scenarios.metrics.value_text import value_text

    unit = "" if row.unit in ("", "1") else f" {row.unit}"
    told = [f"{row.attempts} attempts", f"{row.passes} of {row.judged} passed"]
    if row.middle is not None and row.best is not None:
        median, best = value_text(row.middle), value_text(row.best)
        told.append(f"median {median}, best {best}{unit}")
    if row.percentile is not None:
        told.append(f"percentile {row.percentile:.0f}")
    return ", ".join([*told, f"last seen {row.last_seen[:10]}"])


def _curve_rows(curve: "LearningCurve | str", unit: str) -> list[tuple[str, str]]:
    from scenarios.metrics.value_text import value_text

    if isinstance(curve, str):
        return [("curve", curve)]
    tail = "" if unit in ("", "1") else f" {unit}"
    return [
        ("curve", f"{curve.shape}, rate {value_text(curve.rate)}"),
        ("first attempt", f"{value_text(curve.middle[0])}{tail}"),
        ("goes to", f"{value_text(curve.plateau)}{tail}"),
        (
            "next attempt",
            f"{value_text(curve.middle[-1])}{tail} ({value_text(curve.low[-1])} to "
            f"{value_text(curve.high[-1])} with 90 % confidence)",
        ),
        ("spread", f"{value_text(curve.spread)}{tail} around the curve"),
    ]


def _curve_report(curve: "LearningCurve | str") -> dict[str, object]:
    if isinstance(curve, str):
        return {"reason": curve}
    return {
        "shape": str(curve.shape),
        "plateau": curve.plateau,
        "gain": curve.gain,
        "rate": curve.rate,
        "spread": curve.spread,
        "attempts": curve.attempts.tolist(),
        "middle": curve.middle.tolist(),
        "low": curve.low.tolist(),
        "high": curve.high.tolist(),
    }
