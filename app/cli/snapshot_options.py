"""What `paravol snapshot` was asked for, and what cannot be asked for together."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from app.cli.confidence_map import demand_map
from disk import UserError, demand_place
from paravol.snapshots.outputs import demand_endings
from paravol.snapshots.spool_folder import demand_spool
from paravol.snapshots.view_sources import Lens, Place
from renderers.art.quality import ClassificationName
from renderers.snapshots.client import QualityName, Samples

FPS, HALF_SIDE_MM, PATHS = 25.0, 40.0, 256
UP = (0.0, 0.0, 1.0)
"""What is taken where nothing is said."""


@dataclass(frozen=True, slots=True)
class SnapshotOptions:
    """Hold what the command line asked for; see `paravol snapshot --help`."""

    session: Path | None
    case: Path | None
    volume: Path | None
    view: Path | None
    time_s: float
    until_s: float | None
    path: Path | None
    fps: float
    eye: Place | None
    target: Place | None
    up: Place
    lens: Lens
    half_side_mm: float
    distortion: tuple[float, float]
    classic: bool
    out: tuple[Path, ...]
    save_view: Path | None
    size: int | None
    samples: Samples
    quality: QualityName
    classification: ClassificationName | None
    truth: bool
    paths: int
    noise: float
    state: Path | None
    time_limit_s: float | None
    tolerance: float | None
    against: Literal["fsr", "fast"] | None
    confidence: Path | None
    stereo_mm: float | None
    spool: Path | None
    ranks: int
    threads: int

    @property
    def side(self) -> int:
        """Get the picture's edge in pixels, where no view file has its own."""
        return 512 if self.size is None else self.size

    @property
    def is_film(self) -> bool:
        """Tell whether pictures in a row are asked for."""
        return self.path is not None or self.until_s is not None

    @property
    def files(self) -> tuple[Path, ...]:
        """Get the files to write."""
        if self.out:
            return self.out
        return (Path("out/snapshot.mp4" if self.is_film else "out/snapshot.png"),)


def check(options: SnapshotOptions) -> None:
    """Refuse a mixture before anything slow begins."""
    sources = [options.case, options.volume, options.view]
    if options.session is not None:
        # a session may need to be told where its case lies now
        sources = [options.session, options.volume, options.view]
    elif options.view is not None:
        sources = [options.volume, options.view]
    if sum(one is not None for one in sources) != 1:
        raise UserError(
            "Give either a session folder or --case or --volume or --view, one of them "
            "alone."
        )
    if (options.eye is None) != (options.target is None):
        raise UserError("--eye x y z and --target x y z go together, in mm (LPS).")
    if options.volume is not None and options.eye is None:
        raise UserError("A scan needs --eye x y z and --target x y z, in mm (LPS).")
    own = options.session is not None or options.view is not None
    if own and options.eye is not None:
        raise UserError(
            "A session's moment and a view file have their own view; --eye and "
            "--target belong to --case."
        )
    if options.lens != "equidistant" and options.eye is None:
        raise UserError("--lens belongs to --eye and --target.")
    plain = options.classic or options.volume is not None
    if options.distortion != (0, 0) and options.eye is None:
        raise UserError("--distortion belongs to --eye and --target.")
    if options.lens != "equidistant" and not plain:
        raise UserError(
            f"An endoscope's lens is equidistant; --lens {options.lens} needs "
            "--classic."
        )
    if options.classification and not (plain or options.view is not None):
        raise UserError(
            "--classification is about transfer functions; it needs --classic, "
            "--volume or --view."
        )
    if options.spool is not None and options.ranks != 1:
        raise UserError(
            "--ranks belongs to pictures that are drawn here; the workers of --spool "
            "have their own."
        )
    demand_endings(options.files, film=options.is_film)
    if options.confidence is not None:
        demand_map(options.confidence)
    _check_film(options)
    _check_truth(options)
    for name, value, low, high in (
        ("--size", options.size, 8, 8192),
        ("--fps", options.fps, 0.1, 240.0),
        ("--half-side", options.half_side_mm, 0.01, 1e4),
        ("--time-limit", options.time_limit_s, 0.01, 86_400.0),
        ("--tolerance", options.tolerance, 0.0, 255.0),
        ("--stereo", options.stereo_mm, 0.01, 1000.0),
        ("--ranks", options.ranks, 1, 1024),
        ("--paths", options.paths, 32, 1_048_576),
        ("--noise", options.noise, 0.0, 1.0),
    ):
        if value is not None and not low <= value <= high:
            raise UserError(f"{name} must be {low:g} to {high:.12g}, got {value:g}.")
    _check_idle(options)


def _check_film(options: SnapshotOptions) -> None:
    if not options.is_film:
        return
    extras = {
        "--against": options.against,
        "--confidence": options.confidence,
        "--stereo": options.stereo_mm,
        "--state": options.state,
    }
    for name, value in extras.items():
        if value is not None:
            raise UserError(f"{name} is for a single picture, not for one in a row.")
    if options.path is not None and options.until_s is not None:
        raise UserError("Give either --path or --until, one of them alone.")
    if options.until_s is not None and not _moves(options):
        raise UserError(
            "--until follows a session or a case's exercise; a view that stands still "
            "is moved by --path."
        )
    if options.until_s is not None and not options.until_s > options.time_s:
        raise UserError(
            f"--until must be later than --time, got {options.until_s:g} s after "
            f"{options.time_s:g} s."
        )
    if options.side % 2 and any(file.suffix for file in options.files):
        raise UserError(f"A film needs an even --size, got {options.side}.")


def _check_idle(options: SnapshotOptions) -> None:
    """Refuse what would change nothing: whoever says it means something by it."""
    if not (math.isfinite(options.time_s) and options.time_s >= 0):
        raise UserError(f"--time must be 0 s or later, got {options.time_s:g}.")
    for name, said, wants in (
        (
            "--time",
            options.time_s != 0 and not _moves(options),
            "a session or a case's exercise",
        ),
        ("--fps", options.fps != FPS and not options.is_film, "--until and --path"),
        ("--up", options.up != UP and options.eye is None, "--eye and --target"),
        (
            "--half-side",
            options.half_side_mm != HALF_SIDE_MM and options.lens != "orthographic",
            "--lens orthographic",
        ),
        (
            "--paths",
            options.paths != PATHS and not options.truth,
            "--truth",
        ),
        ("--noise", options.noise != 0 and not options.truth, "--truth"),
    ):
        if said:
            raise UserError(f"{name} belongs to {wants}.")


def demand_places(options: SnapshotOptions) -> None:
    """Raise OSError for a file that could not be written when the picture is there.

    ValueError for a spool folder that is none.
    """
    for file in options.files:
        demand_place(file if file.suffix else file / "frame-00001.png")
    if options.spool is not None:
        demand_spool(options.spool)
    for other in (options.save_view, options.confidence, options.state):
        if other is not None:
            demand_place(other)


def _moves(options: SnapshotOptions) -> bool:
    """Tell whether the view is a moment's: of a session or a case's exercise."""
    return options.session is not None or (
        options.case is not None and options.eye is None and options.view is None
    )


def _check_truth(options: SnapshotOptions) -> None:
    if options.truth and options.classic:
        raise UserError("--truth follows the endoscope's light, not --classic's.")
    if not options.truth and (options.state is not None or options.against == "fast"):
        raise UserError("--state and --against fast belong to --truth.")
    if options.state is not None and options.state.suffix != ".npz":
        raise UserError(f"--state goes to a .npz file, got {options.state}.")
    if options.tolerance is not None and (
        options.truth or options.classic or options.samples != 4 or options.volume
    ):
        raise UserError(
            "--tolerance spares samples of an endoscope's picture with --samples 4; it "
            "goes without --truth, --classic and --volume."
        )
    if options.stereo_mm is not None and (
        options.against or options.confidence or options.state
    ):
        raise UserError("--stereo goes without --against, --confidence and --state.")
