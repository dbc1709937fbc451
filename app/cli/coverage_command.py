"""`paravol coverage`: what a recorded session saw, as a table, a picture, a surface."""

from dataclasses import asdict
from pathlib import Path

import numpy as np

from anatomy.files.surfaces import Surface, save_surface
from app.cli.commands import CoverageOptions
from app.cli.terminal import Stages, print_json, print_table
from disk import UserError, demand_place
from paravol.coverage_map import SessionCoverage, seconds_at, session_coverage
from renderers.scene.image import save_png
from scenarios.bundle import write_json
from scenarios.metrics.value_text import value_text


def run_coverage(session: Path, options: CoverageOptions, *, as_json: bool) -> int:
    """Step the session again; tell what was seen, write what was asked for."""
    for file, endings in ((options.out, (".vtp",)), (options.picture, (".png",))):
        if file is not None and file.suffix.lower() not in endings:
            raise UserError(f"{file} must end in {' or '.join(endings)}.")
    for file in (options.out, options.picture, options.json_file):
        if file is not None:
            demand_place(file)
    with Stages() as stages:
        seen = session_coverage(session, options.case, stages)
    if options.out is not None:
        _write_surface(seen, options.out)
    if options.picture is not None:
        save_png(options.picture, seen.picture())
    report = {"session": session.name, **asdict(seen.watch.figures())}
    if options.json_file is not None:
        write_json(options.json_file, report)
    if as_json:
        print_json(report)
    else:
        _print(session, seen)
    return 0


def _write_surface(seen: SessionCoverage, path: Path) -> None:
    """Write the mucosa with the seconds for which each triangle was in sight."""
    from app.vtk.case_surfaces import zero_set

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


def _print(session: Path, seen: SessionCoverage) -> None:
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
