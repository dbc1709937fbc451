"""`paravol replay`: run, check, report."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.terminal import Stages, print_json, print_table
from disk import UserError
from paravol.score_table import score_rows
from scenarios.bundle import read_notes

if TYPE_CHECKING:
    from paravol.session_replay import ReplayReport


def run_replay(
    folder: Path, *, check: bool, video: Path | None, threads: int, as_json: bool
) -> int:
    """Replay a session; with `check`, 1 unless everything came out the same."""
    from paravol.session_replay import replay_session

    with Stages() as stages:
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
    notes = read_notes(folder)
    return [("note", f"at {note.at_s:.1f} s: {note.text}") for note in notes]


def run_at(
    folder: Path,
    time_s: float,
    picture: Path | None,
    *,
    case: Path | None,
    threads: int,
    as_json: bool,
) -> None:
    """Tell how a session stood at a time, and draw the live picture of then."""
    from paravol.patient import load_patient
    from paravol.session_setup import build_view, flown_scenario
    from paravol.session_timeline import SessionTimeline
    from renderers.scene import save_png
    from scenarios.bundle import read_recording

    recording = read_recording(folder)
    info = recording.info
    scenario = flown_scenario(folder, info, case)
    with Stages() as stages:
        patient = load_patient(scenario, stages)
        timeline = SessionTimeline(folder, patient, recording)
        sample, _ = timeline.go_to(time_s)
        if picture is not None:
            view = build_view(
                scenario,
                timeline.patient,
                tier=info.tier,
                seed=info.seed,
                has_instrument=info.has_instrument or info.operated,
                threads=threads,
                progress=stages,
                visible_sets=info.visible_sets,
            )
            operation = timeline.session.operation
            if operation is not None and operation.lens is not None:
                view.lens = operation.lens.state
            shown = timeline.frame(time_s)
            frame = view.draw(
                timeline.session.view(sample),
                number=0 if shown is None else shown.number,
                elapsed_s=0.0,
                gain=None if shown is None else shown.gain,
            )
            save_png(picture, frame.pixels)
    score = timeline.score()
    if as_json:
        print_json({"time_s": sample.time_s, "score": asdict(score)})
        return
    rows = [("sample", f"{sample.time_s:.2f} s"), *score_rows(score)]
    if picture is not None:
        rows.append(("picture", str(picture)))
    print_table(f"{folder} at {time_s:g} s", rows)


def run_view_at(
    folder: Path, time_s: float, out: Path, *, case: Path | None, quietly: bool
) -> None:
    """Write what a session saw at a time, at the size it was shown, as a view file."""
    import numpy as np

    from paravol.snapshots.view_file import save_view
    from paravol.snapshots.view_sources import session_views
    from scenarios.bundle import read_session

    if not time_s >= 0:
        raise UserError(f"--view-at takes seconds from 0 on, got {time_s:g}.")
    with Stages() as stages:
        width, height = read_session(folder)[0].picture_size
        size = max(width, height)
        _, views = session_views(folder, np.array([time_s]), size, case, stages)
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
