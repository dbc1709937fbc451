"""`paravol snapshot` as it is typed: its options, and what cannot go together.

Nothing heavy is imported here, so that `paravol snapshot --help` comes at once.
"""

from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter
from cyclopts.validators import Number

from app.cli.root import (
    Flag,
    Json,
    Oversubscribe,
    Place,
    Ranks,
    Threads,
    rank_count,
    thread_count,
)
from system import UserError, require_place

WHAT = Parameter(group=Group("What is shown", sort_key=1))
CAMERA = Parameter(group=Group("Camera", sort_key=2))
FILM = Parameter(group=Group("Film", sort_key=3))
QUALITY = Parameter(group=Group("Quality", sort_key=4))
PATH_TRACING = Parameter(group=Group("Path tracing", sort_key=5))
OUTPUT = Parameter(group=Group("Output", sort_key=6))
MACHINE = Parameter(group=Group("Machine", sort_key=7))


def within(low: float, high: float) -> Parameter:
    """Make the parameter that refuses numbers outside a range."""
    return Parameter(validator=Number(gte=low, lte=high))


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class SnapshotOptions:
    """What the command line asked for."""

    session: Annotated[Path | None, Parameter(parse=False)] = None
    case: Annotated[Path | None, WHAT] = None
    """A case folder: seen from --eye, or along its exercise at --time; with a session
    or a view, where the case it is of lies now."""
    volume: Annotated[Path | None, WHAT] = None
    """A scan (DICOM folder, NRRD, NIfTI, MetaImage) with --eye and --target."""
    view: Annotated[Path | None, WHAT] = None
    """A view file, as --save-view writes."""
    time: Annotated[float, WHAT, Parameter(validator=Number(gte=0, lt=inf))] = 0.0
    """Seconds into the session, or along the case's exercise."""
    classic: Annotated[Flag, WHAT] = False
    """Draw by the head's transfer function, not as an endoscope sees it; tools of a
    session or a view file stand in it as metal."""

    eye: Annotated[Place | None, CAMERA] = None
    """Where to look from: x y z in millimetres, patient LPS."""
    target: Annotated[Place | None, CAMERA] = None
    """Where to look at."""
    up: Annotated[Place, CAMERA] = (0.0, 0.0, 1.0)
    """Roughly upwards, for --eye."""
    lens: Annotated[Literal["equidistant", "perspective", "orthographic"], CAMERA] = (
        "equidistant"
    )
    """For --eye; an endoscope's is equidistant."""
    half_side: Annotated[float, CAMERA, within(0.01, 1e4)] = 40.0
    """Millimetres from the middle of an orthographic picture to its edge."""
    distortion: Annotated[tuple[float, float], CAMERA] = (0.0, 0.0)
    """For --eye: k1 and k2 of the lens, barrel where k1 is negative."""
    stereo: Annotated[float | None, CAMERA, within(0.01, 1000)] = None
    """Two eyes so many millimetres apart, side by side."""

    until: Annotated[float | None, FILM] = None
    """Render a film from --time to this second."""
    camera_path: Annotated[Path | None, FILM] = None
    """A file of camera keys: the view is moved along it."""
    fps: Annotated[float, FILM, within(0.1, 240)] = 25.0
    """Pictures per second."""

    size: Annotated[int | None, QUALITY, within(16, 8192)] = None
    """Width and height in pixels; 512, or a view file's own, if none is given."""
    samples: Annotated[Literal[1, 4], QUALITY] = 4
    """Rays of each pixel."""
    quality: Annotated[
        Literal["preview", "snapshot", "final", "reference"], QUALITY
    ] = "snapshot"
    """Step and cut-off of rays."""
    classification: Annotated[Literal["post", "integrated"] | None, QUALITY] = None
    """With --classic: colours of a step by all that the density passes from end to end
    (integrated, the default), which misses no thin shell, or by its middle alone
    (post), which is quicker."""
    tolerance: Annotated[float | None, QUALITY, within(0, 255)] = None
    """Take four samples of a pixel only where they matter most, until the error is
    estimated at so many of 255 codes; 0 takes all, the worst first."""
    time_limit: Annotated[float | None, QUALITY, within(0.01, 86_400)] = None
    """Seconds after which the best picture so far is taken."""

    path_traced: Annotated[Flag, PATH_TRACING] = False
    """Follow the light from wall to wall by random paths; slow, its noise is shown."""
    path_samples: Annotated[int, PATH_TRACING, within(32, 2**20)] = 256
    """Paths of each ray, on average."""
    noise: Annotated[float, PATH_TRACING, within(0, 1)] = 0.0
    """Stop when the noise is this share of the light."""
    state: Annotated[Path | None, PATH_TRACING] = None
    """Keep the paths in this .npz, and continue from those in it."""

    out: Annotated[tuple[Path, ...], OUTPUT] = ()
    """File to write, may be repeated: .png, .exr (linear light, depth, sample count),
    .nrrd (depth); for films .mp4 or a folder of PNGs."""
    save_view: Annotated[Path | None, OUTPUT] = None
    """Write the view as a file, too."""
    against: Annotated[Literal["fsr", "fast"] | None, OUTPUT] = None
    """Compare with the live picture (fsr), or --path-traced with the quick bounce light
    (fast); the error map lands beside the first file."""
    confidence: Annotated[Path | None, OUTPUT] = None
    """Write where the picture may hide a thin wall: .png or .nrrd."""
    json: Annotated[Json, OUTPUT] = False

    spool: Annotated[Path | None, MACHINE] = None
    """Let workers draw that serve this folder, such as `paravol worker --spool DIR`,
    and wait for them."""
    ranks: Annotated[Ranks, MACHINE] = 1
    oversubscribe: Annotated[Oversubscribe, MACHINE] = False
    threads: Annotated[Threads, MACHINE] = 0

    @property
    def side(self) -> int:
        """Return the picture's edge in pixels, where no view file has its own."""
        return 512 if self.size is None else self.size

    @property
    def is_film(self) -> bool:
        """Return whether pictures in a row are asked for."""
        return self.camera_path is not None or self.until is not None

    @property
    def follows_time(self) -> bool:
        """Return whether the view is a moment's: of a session or a case's exercise."""
        return self.session is not None or (
            self.case is not None and self.eye is None and self.view is None
        )

    @property
    def files(self) -> tuple[Path, ...]:
        """Return the files to write."""
        if self.out:
            return self.out
        return (Path("out/snapshot.mp4" if self.is_film else "out/snapshot.png"),)


NOTHING_TYPED = SnapshotOptions()


def snapshot(
    session: Path | None = None,
    *,
    options: SnapshotOptions = NOTHING_TYPED,
) -> int:
    """Render high-quality pictures: of a session, a case, a scan or a saved view.

    Ctrl-C takes the best picture so far and says so in its metadata; a second one
    leaves none.

    Parameters
    ----------
    session
        A recorded session; its view at --time is rendered.
    """
    from app.cli.snapshot_command import run_snapshot

    options = replace(
        options,
        session=session,
        ranks=rank_count(options.ranks, oversubscribe=options.oversubscribe),
        threads=thread_count(options.threads),
    )
    return run_snapshot(options)


def check(options: SnapshotOptions) -> None:
    """Raise UserError for options that do not go together, before the slow work."""
    from paravol.snapshots.outputs import require_endings
    from paravol.snapshots.wall_confidence import require_map

    for is_wrong, sentence in (
        *_about_the_view(options),
        *_about_the_film(options),
        *_about_the_light(options),
        *_without_effect(options),
    ):
        if is_wrong:
            raise UserError(sentence)
    require_endings(options.files, film=options.is_film)
    if options.confidence is not None:
        require_map(options.confidence)


Rules = list[tuple[bool, str]]
"""Whether a rule is broken, and the sentence for it."""


def _about_the_view(options: SnapshotOptions) -> Rules:
    # a session or a view may need to be told where its case lies now
    has_own_view = options.session is not None or options.view is not None
    sources = [options.session, options.view, options.volume]
    sources += [] if has_own_view else [options.case]
    is_placed = options.eye is not None
    return [
        (
            sum(source is not None for source in sources) != 1,
            "Give either a session folder or --case or --volume or --view, one of them "
            "alone.",
        ),
        (
            is_placed != (options.target is not None),
            "--eye x y z and --target x y z go together, in mm (LPS).",
        ),
        (
            options.volume is not None and not is_placed,
            "A scan needs --eye x y z and --target x y z, in mm (LPS).",
        ),
        (
            has_own_view and is_placed,
            "A session's moment and a view file have their own view; --eye and "
            "--target belong to --case.",
        ),
    ]


def _about_the_film(options: SnapshotOptions) -> Rules:
    if not options.is_film:
        return []
    until = options.until
    return [
        *(
            (
                getattr(options, name) is not None,
                f"--{name} is for a single picture, not for one in a row.",
            )
            for name in ("against", "confidence", "stereo", "state")
        ),
        (
            options.camera_path is not None and until is not None,
            "Give either --camera-path or --until, one of them alone.",
        ),
        (
            until is not None and not options.follows_time,
            "--until follows a session or a case's exercise; a view that stands still "
            "is moved by --camera-path.",
        ),
        (
            until is not None and not until > options.time,
            f"--until must be later than --time, got {until} s after {options.time} s.",
        ),
        (
            options.side % 2 == 1 and any(file.suffix for file in options.files),
            f"A film needs an even --size, got {options.side}.",
        ),
    ]


def _about_the_light(options: SnapshotOptions) -> Rules:
    state, is_traced = options.state, options.path_traced
    one_ray = options.samples != 4 or options.volume is not None
    return [
        (
            is_traced and options.classic,
            "--path-traced follows the endoscope's light, not --classic's.",
        ),
        (
            state is not None and state.suffix != ".npz",
            f"--state goes to a .npz file, got {state}.",
        ),
        (
            options.tolerance is not None and (is_traced or options.classic or one_ray),
            "--tolerance spares samples of an endoscope's picture with --samples 4; it "
            "goes without --path-traced, --classic and --volume.",
        ),
        (
            options.stereo is not None
            and any((options.against, options.confidence, state)),
            "--stereo goes without --against, --confidence and --state.",
        ),
    ]


def _without_effect(options: SnapshotOptions) -> Rules:
    """List the options that would change nothing: who gives one expects something."""
    is_placed = options.eye is not None
    is_classic = options.classic or options.volume is not None
    paths = options.path_traced, "--path-traced"
    placed = is_placed, "--eye and --target"
    needs = [
        ("lens", *placed),
        ("lens", is_classic, "--classic: an endoscope's lens is equidistant"),
        ("distortion", *placed),
        ("up", *placed),
        ("half_side", options.lens == "orthographic", "--lens orthographic"),
        ("time", options.follows_time, "a session or a case's exercise"),
        ("fps", options.is_film, "--until and --camera-path"),
        (
            "classification",
            is_classic or options.view is not None,
            "transfer functions, so to --classic, --volume or --view",
        ),
        ("path_samples", *paths),
        ("noise", *paths),
        ("state", *paths),
        ("against", options.against != "fast" or options.path_traced, "--path-traced"),
        (
            "ranks",
            options.spool is None,
            "pictures that are drawn here, not to --spool",
        ),
    ]
    return [
        (
            not has_effect and getattr(options, name) != getattr(NOTHING_TYPED, name),
            f"--{name.replace('_', '-')} {getattr(options, name)} belongs to {wanted}.",
        )
        for name, has_effect, wanted in needs
    ]


def require_places(options: SnapshotOptions) -> None:
    """Raise OSError for a file that could not be written when the picture is there.

    UserError for a spool folder that is none.
    """
    from paravol.snapshots.spool_folder import require_spool

    for file in options.files:
        require_place(file if file.suffix else file / "frame-00001.png")
    if options.spool is not None:
        require_spool(options.spool)
    for other in (options.save_view, options.confidence, options.state):
        if other is not None:
            require_place(other)
