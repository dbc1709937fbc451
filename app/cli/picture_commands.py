"""The command that takes pictures.

Nothing heavy is imported here: the command fetches its own modules when it runs.
"""

from pathlib import Path
from typing import Literal

from app.cli.root import (
    Flag,
    Json,
    Oversubscribe,
    Place,
    Ranks,
    Size,
    Threads,
    app,
    rank_count,
    thread_count,
)


@app.command
def snapshot(
    session: Path | None = None,
    *,
    time: float = 0.0,
    until: float | None = None,
    case: Path | None = None,
    volume: Path | None = None,
    view: Path | None = None,
    path: Path | None = None,
    fps: float = 25.0,
    eye: Place | None = None,
    target: Place | None = None,
    up: Place = (0.0, 0.0, 1.0),
    lens: Literal["equidistant", "perspective", "orthographic"] = "equidistant",
    half_side: float = 40.0,
    distortion: tuple[float, float] = (0.0, 0.0),
    classic: Flag = False,
    out: tuple[Path, ...] = (),
    save_view: Path | None = None,
    size: Size | None = None,
    samples: Literal[1, 4] = 4,
    quality: Literal["preview", "snapshot", "final", "reference"] = "snapshot",
    classification: Literal["post", "integrated"] | None = None,
    truth: Flag = False,
    paths: int = 256,
    noise: float = 0.0,
    state: Path | None = None,
    time_limit: float | None = None,
    tolerance: float | None = None,
    against: Literal["fsr", "fast"] | None = None,
    confidence: Path | None = None,
    stereo: float | None = None,
    spool: Path | None = None,
    ranks: Ranks = 1,
    oversubscribe: Oversubscribe = False,
    threads: Threads = 0,
    json: Json = False,
) -> int:
    """Render high-quality pictures: of a session, a case, a scan or a saved view.

    Ctrl-C takes the best picture so far and says so in its metadata; a second one
    leaves none.

    Parameters
    ----------
    session
        A recorded session; its view at --time is rendered.
    time
        Seconds into the session, or along the case's exercise.
    until
        Render a film from --time to this second.
    case
        A case folder: seen from --eye, or along its exercise at --time; with a session
        or a view, where the case it is of lies now.
    volume
        A scan (DICOM folder, NRRD, NIfTI, MetaImage) with --eye and --target.
    view
        A view file, as --save-view writes.
    path
        A file of camera keys: the view is moved along it, for a film.
    fps
        Pictures per second of a film.
    eye
        Where to look from: x y z in millimetres, patient LPS.
    target
        Where to look at.
    up
        Roughly upwards, for --eye.
    lens
        For --eye; an endoscope's is equidistant.
    half_side
        Millimetres from the middle of an orthographic picture to its edge.
    distortion
        For --eye: k1 and k2 of the lens, barrel where k1 is negative.
    classic
        Draw by the head's transfer function, not as an endoscope sees it; tools of a
        session or a view file stand in it as metal.
    out
        File to write, may be repeated: .png, .exr (linear light, depth, sample count),
        .nrrd (depth); for films .mp4 or a folder of PNGs.
    save_view
        Write the view as a file, too.
    size
        Width and height of the picture in pixels; 512, or a view file's own, if none
        is given.
    samples
        Rays of each pixel.
    quality
        Step and cut-off of rays: preview, snapshot, final or reference.
    classification
        With --classic: colours of a step by all that the density passes from end to
        end (integrated, the default), which misses no thin shell, or by its middle
        alone (post), which is quicker.
    truth
        Follow the light from wall to wall by random paths; slow, its noise is told.
    paths
        With --truth: paths of each ray, on average.
    noise
        With --truth: stop when the noise is this share of the light.
    state
        With --truth: keep the paths in this .npz, and go on with those there.
    time_limit
        Seconds after which the best picture so far is taken.
    tolerance
        Take four samples of a pixel only where they matter most, until the error is
        estimated at so many of 255 codes; 0 takes all, the worst first.
    against
        Compare with the live picture (fsr), or --truth with the quick bounce light
        (fast); the error map lands beside the first file.
    confidence
        Write where the picture may hide a thin wall: .png or .nrrd.
    stereo
        Two eyes so many millimetres apart, side by side.
    spool
        Let workers draw that serve this folder, such as `paravol worker --spool DIR`,
        and wait for them.
    """
    from app.cli.snapshot_command import run_snapshot
    from app.cli.snapshot_options import SnapshotOptions

    options = SnapshotOptions(
        session=session,
        case=case,
        volume=volume,
        view=view,
        time_s=time,
        until_s=until,
        path=path,
        fps=fps,
        eye=eye,
        target=target,
        up=up,
        lens=lens,
        half_side_mm=half_side,
        distortion=distortion,
        classic=classic,
        out=out,
        save_view=save_view,
        size=size,
        samples=samples,
        quality=quality,
        classification=classification,
        truth=truth,
        paths=paths,
        noise=noise,
        state=state,
        time_limit_s=time_limit,
        tolerance=tolerance,
        against=against,
        confidence=confidence,
        stereo_mm=stereo,
        spool=spool,
        ranks=rank_count(ranks, oversubscribe=oversubscribe),
        threads=thread_count(threads),
    )
    return run_snapshot(options, as_json=json)
