"""`paravol replay`: run, check, report."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.page_window import run_page
from app.cli.replay_options import REPLAYED, ReplayOptions
from app.cli.root import Json, thread_count
from app.cli.terminal import ProgressReporter, print_json, print_table
from system import UserError

if TYPE_CHECKING:
    from app.window.main_window import MainWindow
    from app.window.replay.replay_page import ReplayPage
    from paravol.sessions.session_pictures import SessionPictures, SideBySide
    from paravol.sessions.session_replay import ReplayReport


def replay(
    session: Path, *, options: ReplayOptions = REPLAYED, json: Json = False
) -> int:
    """Run a recorded session again, without the device; film it, or two together.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    """
    options.require_sense()
    options = replace(options, threads=thread_count(options.threads))
    if options.window:
        return _run_window(session, options)
    if options.at is not None:
        run_at(session, options.at, options, as_json=json)
        return 0
    if options.view_at is not None and options.out is not None:
        run_view_at(
            session, options.view_at, options.out, case=options.case, quietly=json
        )
        if not options.check and options.video is None:
            return 0
    if options.is_own_film:
        run_film(session, options, as_json=json)
        return 0
    return run_replay(
        session,
        check=options.check,
        video=options.video,
        threads=options.threads,
        as_json=json,
    )


def _run_window(folder: Path, options: ReplayOptions) -> int:
    """Show a session, and the one beside it; a bundle that cannot is told there."""

    def make(
        window: "MainWindow", edge_samples: int
    ) -> "tuple[ReplayPage, Callable[[], object]]":
        from app.window.replay.replay_page import ReplayPage
        from paravol.sessions.replay_events import ReplayOrder

        page = ReplayPage(edge_samples=edge_samples)
        window.dropped.connect(page.open)
        order = ReplayOrder(
            folder, options.beside, options.case, threads=options.threads or None
        )
        return page, lambda: page.replay(order)

    return run_page(make)


def run_replay(
    folder: Path, *, check: bool, video: Path | None, threads: int, as_json: bool
) -> int:
    """Replay a session; with `check`, 1 unless everything came out the same."""
    from paravol.scoring.score_table import score_rows
    from paravol.sessions.session_replay import replay_session

    with ProgressReporter() as stages:
        report = replay_session(folder, threads=threads, progress=stages, video=video)
    if as_json:
        print_json(
            {
                **asdict(report),
                "good_s": report.good_s,
                "is_exact": report.is_exact,
            }
        )
    else:
        unknown = "not compared: a part is lost" if report.damages else "not recorded"
        same = {True: "the same", False: "DIFFERENT", None: unknown}
        print_table(
            f"Replay of {folder}",
            [
                *[("recording", line) for line in _state(report)],
                ("samples", str(report.samples)),
                ("frames", str(report.frames)),
                ("frames that differ", _differing(report)),
                ("score", same[report.same_score]),
                *score_rows(report.score),
                *_notes(folder),
                *([("film", str(video))] if video else []),
            ],
        )
    return 1 if check and not report.is_exact else 0


def _notes(folder: Path) -> list[tuple[str, str]]:
    """Return what a teacher said about a session, if anything."""
    from scenarios.bundle import read_notes

    notes = read_notes(folder)
    return [("note", f"at {note.at_s:.1f} s: {note.text}") for note in notes]


def run_at(
    folder: Path, time_s: float, options: ReplayOptions, *, as_json: bool
) -> None:
    """Tell how a session stood at a time, and draw the live picture of then."""
    from paravol.scoring.score_table import score_rows
    from renderers.scene import save_png

    with ProgressReporter() as stages:
        here, shown = _pictures(folder, options, stages)
        sample, _ = here.timeline.go_to(time_s)
        if options.picture is not None:
            save_png(options.picture, shown.at(time_s))
    score = here.timeline.score()
    if as_json:
        print_json({"time_s": sample.time_s, "score": asdict(score)})
        return
    rows = [("sample", f"{sample.time_s:.2f} s"), *score_rows(score)]
    if options.picture is not None:
        rows.append(("picture", str(options.picture)))
        rows += _alignment(options, shown)
    print_table(f"{folder} at {time_s:g} s", rows)


def run_film(folder: Path, options: ReplayOptions, *, as_json: bool) -> None:
    """Write a film at a speed, of a part, by another camera, or of two sessions."""
    from paravol.sessions.session_pictures import SideBySide, film_session

    assert options.video is not None
    speed = 1.0 if options.speed is None else options.speed
    with ProgressReporter() as stages:
        here, shown = _pictures(folder, options, stages)
        timeline = here.timeline
        from_s = timeline.begin_s if options.from_s is None else options.from_s
        to_s = timeline.end_s if options.to_s is None else options.to_s
        if not timeline.begin_s <= from_s < to_s <= timeline.end_s:
            raise UserError(
                f"{folder} lasts from {timeline.begin_s:.1f} to {timeline.end_s:.1f} s "
                f"and cannot be shown from {from_s:g} to {to_s:g} s."
            )
        lasts_s = film_session(
            options.video, shown, (from_s, to_s), speed=speed, progress=stages
        )
    if as_json:
        names = list(shown.times.names) if isinstance(shown, SideBySide) else []
        print_json({"film": str(options.video), "film_s": lasts_s, "aligned_by": names})
        return
    rows = [
        ("film", str(options.video)),
        ("shows", f"{from_s:.1f} to {to_s:.1f} s at {speed:g} times the speed"),
        ("lasts", f"{lasts_s:.1f} s"),
    ]
    rows += _alignment(options, shown)
    print_table(f"Film of {folder}", rows)


def _alignment(
    options: ReplayOptions, shown: "SessionPictures | SideBySide"
) -> list[tuple[str, str]]:
    """Return what ties a session to the one beside it."""
    from paravol.sessions.session_pictures import SideBySide

    if not isinstance(shown, SideBySide):
        return []
    by = "; ".join(shown.times.names) or "nothing that both reached"
    return [("beside", str(options.beside)), ("aligned by", by)]


def _pictures(
    folder: Path, options: ReplayOptions, stages: "ProgressReporter"
) -> "tuple[SessionPictures, SessionPictures | SideBySide]":
    """Return the session's pictures, and those that were asked for."""
    from paravol.sessions.session_pictures import SessionPictures, SideBySide
    from paravol.snapshots.view_file import load_view

    camera = None if options.camera is None else load_view(options.camera).camera
    here = SessionPictures(
        folder,
        camera=camera,
        case=options.case,
        threads=options.threads,
        progress=stages,
    )
    if options.beside is None:
        return here, here
    there = SessionPictures(
        options.beside,
        camera=camera,
        size=here.size,
        threads=options.threads,
        progress=stages,
        patient=here.patient,
    )
    return here, SideBySide(here, there)


def run_view_at(
    folder: Path, time_s: float, out: Path, *, case: Path | None, quietly: bool
) -> None:
    """Write what a session saw at a time, at the size it was shown, as a view file."""
    import numpy as np

    from paravol.snapshots.view_file import save_view
    from paravol.snapshots.view_sources import session_views

    if not time_s >= 0:
        raise UserError(f"--view-at takes seconds from 0 on, got {time_s:g}.")
    with ProgressReporter() as stages:
        _, views = session_views(folder, np.array([time_s]), None, case, stages)
        save_view(out, views[0])
    if not quietly:
        print(f"{out}: the view at {time_s:g} s, for paravol snapshot --view {out}")


def _state(report: "ReplayReport") -> list[str]:
    """Return whether the recording is whole, a line for each damaged part."""
    lines = []
    for lost in report.damages:
        where = f"damaged, bytes {lost.first_byte:,} to {lost.end_byte:,}"
        if lost.to_s <= lost.from_s:
            lines.append(f"{where}: no flight is lost")
            continue
        count = "" if lost.samples is None else f", {lost.samples} samples"
        lines.append(f"{where}: {lost.from_s:.2f} to {lost.to_s:.2f} s lost{count}")
    if report.damages:
        lines.append(f"{report.good_s:.1f} of {report.seconds:.1f} s are good")
    if not report.complete:
        lines.append(f"ends in the middle, after {report.seconds:.1f} s")
    return lines or ["complete"]


def _differing(report: "ReplayReport") -> str:
    if report.same_look:
        return str(len(report.differing_frames))
    return "not compared: recorded with another look than this version draws"
