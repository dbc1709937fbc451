"""`paravol coverage`: what a recorded session saw, as a table, a picture, a surface."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import Parameter

from app.cli.root import Json
from app.cli.terminal import ProgressReporter, print_json, print_table
from system import UserError, require_place

if TYPE_CHECKING:
    from paravol.slices.coverage_map import SessionCoverage


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class CoverageOptions:
    """Options of coverage, as they were typed.

    Parameters
    ----------
    out
        Write the mucosa as a surface (.vtp, LPS) with the seconds each part was seen.
    picture
        Write a picture (.png) of the opened nose, coloured likewise.
    json_file
        Write all values.
    case
        Where the case that was flown through lies now.
    """

    out: Path | None = None
    picture: Path | None = None
    json_file: Path | None = None
    case: Path | None = None


def coverage(
    session: Path, *, options: CoverageOptions = CoverageOptions(), json: Json = False
) -> int:
    """Tell which mucosa and landmarks a recorded session really saw, site by site.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    """
    from paravol.slices.coverage_map import session_coverage
    from renderers.scene.image import save_png
    from scenarios.bundle import write_json

    for file, endings in ((options.out, (".vtp",)), (options.picture, (".png",))):
        if file is not None and file.suffix.lower() not in endings:
            raise UserError(f"{file} must end in {' or '.join(endings)}.")
    for file in (options.out, options.picture, options.json_file):
        if file is not None:
            require_place(file)
    with ProgressReporter() as stages:
        seen = session_coverage(session, options.case, stages)
    if options.out is not None:
        _write_surface(seen, options.out)
    if options.picture is not None:
        save_png(options.picture, seen.picture())
    report = {"session": session.name, **asdict(seen.watch.figures())}
    if options.json_file is not None:
        write_json(options.json_file, report)
    if json:
        print_json(report)
    else:
        _print(session, seen)
    return 0


def _write_surface(seen: "SessionCoverage", path: Path) -> None:
    """Write the mucosa with the seconds for which each triangle was in sight."""
    import numpy as np

    from anatomy.files.surfaces import Surface, save_surface
    from app.vtk.case_surfaces import zero_set
    from paravol.slices.coverage_map import seconds_at

    surface = zero_set(seen.distance)
    if surface is None or not len(seen.watch.mucosa.area_mm2):
        raise UserError("The head has no surface to paint on.")
    middle, normals = surface.middles()
    # mucosa looks into the air; the face and closed cells are no mucosa to be seen
    seconds = seconds_at(seen.watch, middle, -normals)
    is_mucosa = np.isfinite(seconds)
    corners, faces = np.unique(surface.faces[is_mucosa], return_inverse=True)
    mucosa = Surface(surface.vertices[corners], faces.reshape(-1, 3).astype(np.int32))
    save_surface(mucosa, path, {"seconds_seen": seconds[is_mucosa]})


def _print(session: Path, seen: "SessionCoverage") -> None:
    from scenarios.metrics.value_text import value_text

    figures = seen.watch.figures()
    rows = [
        (
            name,
            value_text(site.seen_percent, site.uncertain_percent, "%")
            + f" of {site.area_mm2:.0f} mm2",
        )
        for name, site in figures.sites.items()
    ]
    rows += [
        (f"landmark: {name}", f"seen after {time_s:.1f} s")
        for name, time_s in figures.landmarks_s.items()
    ]
    print_table(f"Mucosa seen in {session}", rows)
