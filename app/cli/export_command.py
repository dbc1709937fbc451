"""`paravol export`: a case's surfaces as PLY, VTP or STL."""

from pathlib import Path

from anatomy.case import read_case
from anatomy.files.surfaces import Surface, save_surface
from app.cli.terminal import Stages, print_json, print_table
from app.vtk.case_surfaces import case_surfaces
from paravol.output_folder import claimed_folder


def run_export(*, case: Path, out: Path, ending: str, as_json: bool) -> int:
    """Read the case, write its surfaces, tell what they are."""
    written: dict[str, Surface] = {}
    with Stages() as stages, claimed_folder(out):
        stages("Reading the case", 0.0)
        read = read_case(case)
        stages("Reading the case", 1.0)
        for share, name, surface in case_surfaces(read):
            stages("Writing surfaces", share)
            file = f"{name.replace(' ', '_')}.{ending}"
            save_surface(surface, out / file)
            written[file] = surface
    counts = {file: len(surface.faces) for file, surface in written.items()}
    if as_json:
        print_json({"folder": str(out), "triangles": counts, "space": "LPS"})
    else:
        print_table(str(out), [(f, f"{n:,} triangles") for f, n in counts.items()])
    return 0
