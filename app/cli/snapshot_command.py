"""`paravol snapshot`: high-quality pictures of a session, a case, a scan or a view."""

import warnings

import msgspec
import numpy as np
from numpy.typing import NDArray

from app.cli.snapshot_options import SnapshotOptions, check, require_places
from app.cli.terminal import ProgressReporter, print_json
from paravol.snapshots.camera_path import load_camera_path, views_along
from paravol.snapshots.comparison import require_splats
from paravol.snapshots.film import FilmReport, draw_film
from paravol.snapshots.head_scene import HeadScene, RenderSettings
from paravol.snapshots.render_session import render_session
from paravol.snapshots.still import Extras, StillReport, draw_still
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
from paravol.snapshots.wall_confidence import rated_surface
from renderers.scene import UpWarning
from renderers.snapshots.request import PathTracingSpec
from system import UserError

INTERRUPTED = 130
MOST_FRAMES = 20_000


def run_snapshot(options: SnapshotOptions) -> int:
    """Render and save; return the exit status."""
    check(options)
    require_places(options)
    settings = _render_settings(options)
    with ProgressReporter() as stages:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UpWarning)
            head, views = _views(options, stages)
        messages = list(dict.fromkeys(str(found.message) for found in caught))
        for view in views[:1] + views[-1:]:
            head.demand(view)
            _require_light(options, view)
            if options.against == "fsr":
                require_splats(view)
        if options.confidence is not None:
            rated_surface(head)
        if options.save_view is not None:
            save_view(options.save_view, views[0])
        report: StillReport | FilmReport
        with render_session(
            head, stages, stages.say, ranks=options.ranks, spool=options.spool
        ) as session:
            if options.is_film:
                report = draw_film(session, views, settings, options.files, options.fps)
            else:
                extras = Extras(
                    options.state, options.stereo, options.against, options.confidence
                )
                report = draw_still(
                    session, views[0], settings, options.files, extras, options.threads
                )
    if options.json:
        print_json({**msgspec.to_builtins(report), "warnings": messages})
    else:
        _print_report(report, messages, refined=options.tolerance is not None)
    return INTERRUPTED if session.interrupted else 0


def _render_settings(options: SnapshotOptions) -> RenderSettings:
    spec = None
    if options.path_traced:
        spec = PathTracingSpec(paths=options.path_samples, noise=options.noise)
    return RenderSettings(
        options.quality,
        options.samples,
        spec,
        options.time_limit,
        options.classification or "integrated",
        options.tolerance,
    )


def _views(
    options: SnapshotOptions, stages: ProgressReporter
) -> tuple[HeadScene, list[ViewFile]]:
    """Return the head, and a view of it for each picture."""
    times = np.array([options.time])
    path = None
    if options.until is not None:
        times = np.arange(options.time, options.until, 1 / options.fps)
    elif options.camera_path is not None:
        path = load_camera_path(options.camera_path)
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
        at = np.array([options.time])
    head, views = _views_at(options, at, stages)
    if options.classic:
        views = [msgspec.structs.replace(view, look=ClassicLook()) for view in views]
    return head, views if path is None else views_along(path, views[0], times)


def _views_at(
    options: SnapshotOptions, times: NDArray[np.float64], stages: ProgressReporter
) -> tuple[HeadScene, list[ViewFile]]:
    if options.session is not None:
        return session_views(options.session, times, options.side, options.case, stages)
    if options.view is not None:
        view = load_view(options.view)
        if options.case is not None:
            shrunk = isinstance(view.head, CaseHead) and view.head.decongested
            case = CaseHead(str(options.case), shrunk)
            view = msgspec.structs.replace(view, head=case)
        if options.size is not None:
            view = msgspec.structs.replace(view, size_px=(options.size, options.size))
        return HeadScene.of(view.head, stages), [view]
    if options.eye is None:
        assert options.case is not None
        return case_views(options.case, times, options.side, stages)
    assert options.target is not None
    head: Head
    if options.volume is not None:
        head = ScanHead(str(options.volume.resolve()))
    else:
        assert options.case is not None
        head = CaseHead(str(options.case.resolve()))
    classic = options.classic or options.volume is not None
    lens = options.lens
    if classic and lens == "equidistant":
        lens = "perspective"
    view = placed_view(
        head,
        options.eye,
        options.target,
        up=options.up,
        size=options.side,
        lens=lens,
        half_side_mm=options.half_side,
        distortion=options.distortion,
        classic=classic,
    )
    return HeadScene.of(head, stages), [view]


def _require_light(options: SnapshotOptions, view: ViewFile) -> None:
    """Raise UserError where the endoscope's light is asked for, and there is none."""
    name = "--path-traced" if options.path_traced else "--tolerance"
    if (options.path_traced or options.tolerance is not None) and isinstance(
        view.look, ClassicLook
    ):
        raise UserError(
            f"{name} is about the endoscope's light, and the view is in mode classic; "
            "leave it out, or look in mode scope."
        )


def _print_report(
    report: StillReport | FilmReport, messages: list[str], *, refined: bool
) -> None:
    files, error = ", ".join(report.files), None
    if isinstance(report, FilmReport):
        print(f"{files}: {report.frames} pictures, {report.seconds:.1f} s")
    else:
        result, error = report.result, report.result.error
        print(
            f"{files}: {result.width} x {result.height}, "
            f"{result.seconds['total']:.1f} s"
        )
        if error is not None and refined:
            print(
                f"four samples for {(4 * result.traced - 1) / 3:.0%} of the pixels, "
                f"one for the others: error estimated at {error:.2f} codes rms"
            )
        if result.camera_in_tissue:
            print("the camera stands in tissue: it sees nothing but what it stands in")
        if result.noise is not None:
            print(f"light by paths: noise {result.noise:.2%} of the light (1 sd, rms)")
    for line in messages:
        print(f"warning: {line}")
    if not report.complete:
        off = "" if error is None else f", its error estimated at {error:.1f} codes rms"
        print(
            f"stopped early: this is the best picture so far{off}; its metadata say so"
        )
    if isinstance(report, FilmReport):
        return
    if report.against is not None:
        codes, light = report.against.codes, report.against.light
        line = f"RMSE {codes.rmse:.2f} codes, SSIM {codes.ssim:.4f}"
        if light is not None:
            line += f", linear light {light:.2%} of its mean"
        print(f"{report.against.file}: {line}")
    if report.confidence is not None:
        found = report.confidence
        print(
            f"{found.file}: {found.sure:.1%} of the field sure to hide no wall "
            f"(walls from {found.resolved_mm:g} mm are never lost)"
        )
