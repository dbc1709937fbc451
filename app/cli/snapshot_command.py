"""`paravol snapshot`: high-quality pictures of a session, a case, a scan or a view."""

import warnings
from dataclasses import asdict, replace
from typing import Any

import msgspec
import numpy as np

from app.cli.confidence_map import demand_walls, save_doubt
from app.cli.drawing import Drawing
from app.cli.film import LEAST_S, draw_film
from app.cli.live_comparison import demand_splats, judge, splatted
from app.cli.snapshot_options import SnapshotOptions, check, demand_places
from app.cli.terminal import Stages, print_json
from disk import UserError
from paravol.snapshots.camera_path import load_camera_path, views_along
from paravol.snapshots.outputs import Drawn, save_drawn
from paravol.snapshots.path_state import key_of, load_state, save_state
from paravol.snapshots.stereo import both_eyes, exposed
from paravol.snapshots.studio import Fineness, Studio
from paravol.snapshots.view_file import (
    CaseHead,
    ClassicLook,
    Head,
    ScanHead,
    ViewFile,
    load_view,
    save_view,
)
from paravol.snapshots.view_sources import case_views, placed_view, session_views
from renderers.scene import UpWarning
from renderers.snapshots.client import Snapshot
from renderers.snapshots.request import TruthSpec

INTERRUPTED = 130
MOST_FRAMES = 20_000


def run_snapshot(options: SnapshotOptions, *, as_json: bool) -> int:
    """Render and save; ValueError when the ways to ask are mixed."""
    check(options)
    demand_places(options)
    fineness = _fineness(options)
    with Stages() as stages:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UpWarning)
            studio, views = _views(options, stages)
        told = list(dict.fromkeys(str(found.message) for found in caught))
        for view in views[:1] + views[-1:]:
            studio.demand(view)
            _demand_light(options, view)
            if options.against == "fsr":
                demand_splats(view)
        if options.confidence is not None:
            demand_walls(studio)
        if options.save_view is not None:
            save_view(options.save_view, views[0])
        with Drawing(studio, options.ranks, stages, options.spool) as drawing:
            if options.is_film:
                report = draw_film(
                    drawing, views, fineness, options.files, options.fps, stages
                )
            else:
                report = _still(drawing, studio, views[0], fineness, options)
    report["warnings"] = told
    if as_json:
        print_json(report)
    else:
        _tell(report, refined=options.tolerance is not None)
    return INTERRUPTED if drawing.interrupted else 0


def _fineness(options: SnapshotOptions) -> Fineness:
    truth = None
    if options.truth:
        truth = TruthSpec(paths=options.paths, noise=options.noise)
    return Fineness(
        options.quality,
        options.samples,
        truth,
        options.time_limit_s,
        options.classification or "integrated",
        options.tolerance,
    )


def _views(options: SnapshotOptions, stages: Stages) -> tuple[Studio, list[ViewFile]]:
    times = np.array([options.time_s])
    path = None
    if options.until_s is not None:
        times = np.arange(options.time_s, options.until_s, 1 / options.fps)
    elif options.path is not None:
        path = load_camera_path(options.path)
        first, last = path.span_s
        times = np.arange(first, last + 0.5 / options.fps, 1 / options.fps)
        times = np.minimum(times, last)
    if len(times) > MOST_FRAMES:
        raise UserError(
            f"{len(times)} pictures in a row are more than {MOST_FRAMES}; take fewer "
            "with --fps or a shorter time."
        )
    at = times if path is None else times[:1]
    if path is not None and (options.session is not None or options.eye is None):
        at = np.array([options.time_s])
    studio, views = _sights(options, at, stages)
    if options.classic:
        views = [_classic(view) for view in views]
    return studio, views if path is None else views_along(path, views[0], times)


def _sights(
    options: SnapshotOptions, times: Any, stages: Stages
) -> tuple[Studio, list[ViewFile]]:
    if options.session is not None:
        return session_views(options.session, times, options.side, options.case, stages)
    if options.view is not None:
        view = load_view(options.view)
        if options.case is not None:
            head = CaseHead(str(options.case))
            view = msgspec.structs.replace(view, head=head)
        if options.size is not None:
            size = options.size, options.size
            view = msgspec.structs.replace(view, size_px=size)
        return Studio.of(view.head, stages), [view]
    if options.eye is None:
        assert options.case is not None
        return case_views(options.case, times, options.side, stages)
    assert options.target is not None
    place: Head
    if options.volume is not None:
        place = ScanHead(str(options.volume.resolve()))
    else:
        assert options.case is not None
        place = CaseHead(str(options.case.resolve()))
    classic = options.classic or options.volume is not None
    lens = options.lens
    if classic and lens == "equidistant":
        lens = "perspective"
    view = placed_view(
        place,
        options.eye,
        options.target,
        up=options.up,
        size=options.side,
        lens=lens,
        half_side_mm=options.half_side_mm,
        distortion=options.distortion,
        classic=classic,
    )
    return Studio.of(place, stages), [view]


def _demand_light(options: SnapshotOptions, view: ViewFile) -> None:
    """Raise ValueError where the endoscope's light is asked for, and there is none."""
    asked = "--truth" if options.truth else "--tolerance"
    if (options.truth or options.tolerance is not None) and isinstance(
        view.look, ClassicLook
    ):
        raise UserError(
            f"{asked} is about the endoscope's light, and the view is in mode classic; "
            "leave it out, or look in mode scope."
        )


def _classic(view: ViewFile) -> ViewFile:
    return msgspec.structs.replace(view, look=ClassicLook())


def _still(
    drawing: Drawing,
    studio: Studio,
    view: ViewFile,
    fineness: Fineness,
    options: SnapshotOptions,
) -> dict[str, Any]:
    """Draw one picture and all that was asked for beside it."""
    key = key_of(studio, view, fineness)
    if options.state is not None and fineness.truth is not None:
        state = load_state(options.state, key)
        if state is not None:
            digest = drawing.client.put(state)
            truth = msgspec.structs.replace(fineness.truth, state=digest)
            fineness = replace(fineness, truth=truth)
    if options.stereo_mm is None:
        drawn, job = drawing.draw(view, fineness, "Rendering the snapshot")
    else:
        drawn, job = _pair(drawing, view, fineness, options.stereo_mm)
    for file in options.files:
        save_drawn(file, drawn)
    report: dict[str, Any] = {
        "file": str(options.files[0]),
        "files": [str(file) for file in options.files],
        "complete": drawn.result.complete,
        "result": drawn.result,
    }
    if options.state is not None and (job.folder / "paths.npy").exists():
        save_state(options.state, job.state(), key)
        report["state"] = str(options.state)
    if options.against is not None and not drawing.interrupted:
        report["against"] = _against(drawing, studio, drawn, fineness, options)
    if options.confidence is not None:
        doubt = save_doubt(studio, drawn, options.confidence, options.threads)
        report["confidence"] = asdict(doubt)
    return report


def _pair(
    drawing: Drawing, view: ViewFile, fineness: Fineness, apart_mm: float
) -> tuple[Drawn, Snapshot]:
    """Draw two eyes; they share the time, and what stops one stops both."""
    half = fineness.seconds and replace(fineness, seconds=fineness.seconds / 2)
    eyes = both_eyes(view, apart_mm)
    left, job = drawing.draw(eyes[0], half or fineness, "Rendering the left eye")
    if drawing.interrupted:
        half = replace(fineness, seconds=LEAST_S)
    # one camera, one exposure
    other = exposed(eyes[1], left.result.gain)
    right, _ = drawing.draw(other, half or fineness, "Rendering the right eye")
    return left.beside(right, apart_mm), job


def _against(
    drawing: Drawing,
    studio: Studio,
    drawn: Drawn,
    fineness: Fineness,
    options: SnapshotOptions,
) -> dict[str, Any]:
    first = options.files[0]
    file = first.with_name(f"{first.stem}-error.png")
    if options.against == "fsr":
        quick = splatted(
            studio, drawn.view, drawn.result.gain, options.threads, fineness.samples
        )
        return asdict(judge(quick, drawn, file, ("live (FSR)", "snapshot (ART)")))
    fast = replace(fineness, truth=None, seconds=None)
    view = exposed(drawn.view, drawn.result.gain)
    other, _ = drawing.draw(view, fast, "Rendering with the quick bounce light")
    names = ("quick bounce light", "light by paths")
    return asdict(judge(other.pixels, drawn, file, names, other.rgba))


def _tell(report: dict[str, Any], *, refined: bool) -> None:
    """Say in a few lines what came out."""
    if "frames" in report:
        print(
            f"{', '.join(report['files'])}: {report['frames']} pictures, "
            f"{report['seconds']:.1f} s"
        )
    else:
        result = report["result"]
        print(
            f"{', '.join(report['files'])}: {result.width} x {result.height}, "
            f"{result.seconds['total']:.1f} s"
        )
        if result.error is not None and refined:
            print(
                f"four samples for {(4 * result.traced - 1) / 3:.0%} of the pixels, "
                f"one for the others: error estimated at {result.error:.2f} codes rms"
            )
        if result.camera_in_tissue:
            print("the camera stands in tissue: it sees nothing but what it stands in")
        if result.noise is not None:
            print(f"light by paths: noise {result.noise:.2%} of the light (1 sd, rms)")
    for line in report["warnings"]:
        print(f"warning: {line}")
    if not report["complete"]:
        error = getattr(report.get("result"), "error", None)
        off = "" if error is None else f", its error estimated at {error:.1f} codes rms"
        print(
            f"stopped early: this is the best picture so far{off}; its metadata say so"
        )
    if "against" in report:
        found = report["against"]
        codes = found["codes"]
        line = f"RMSE {codes['rmse']:.2f} codes, SSIM {codes['ssim']:.4f}"
        if found["light"] is not None:
            line += f", linear light {found['light']:.2%} of its mean"
        print(f"{found['file']}: {line}")
    if "confidence" in report:
        found = report["confidence"]
        print(
            f"{found['file']}: {found['sure']:.1%} of the field sure to hide no wall "
            f"(walls from {found['resolved_mm']:g} mm are never lost)"
        )
