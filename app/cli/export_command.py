"""`paravol export`: a case's surfaces as PLY, VTP or STL, or its scan as DICOM."""

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.cli.exchange_command import run_session_export
from app.cli.root import Json
from app.cli.terminal import ProgressReporter, print_json, print_table
from system import UserError

if TYPE_CHECKING:
    from anatomy.case import Case


def export(
    case: Path,
    *,
    out: Path,
    format: Literal["ply", "vtp", "stl", "dicom", "perktutor", "seq", "csv"] = "ply",
    json: Json = False,
) -> int:
    """Write a case's surfaces or images, or a session's motion, for other programs.

    Parameters
    ----------
    case
        A case folder, as import and phantom write, or a session, NAME.paravol.
    out
        Of a case: folder for the surfaces: air, skin, and each cavity or structure; or
        for its images. Of a session: the file.
    format
        Of a case, in patient LPS millimetres: PLY for printers and viewers, VTP for
        ParaView and 3D Slicer, STL for printers; dicom, its slices and its labels as
        CT or MR images and a segmentation, for archives and their viewers. Of a
        session: perktutor, XML of its Transform Recorder; seq, a .seq.mha or .seq.nrrd
        of 3D Slicer and PLUS; csv, all samples.
    """
    is_session = (case / "session.json").is_file()
    if format in ("perktutor", "seq", "csv"):
        if not is_session:
            raise UserError(f"--format {format} is for sessions; {case} is none.")
        return run_session_export(case, out, format, as_json=json)
    if is_session:
        raise UserError(
            f"{case} is a session; say with --format perktutor, seq or csv how."
        )
    return _export_case(case, out, format, as_json=json)


def _export_case(case: Path, out: Path, ending: str, *, as_json: bool) -> int:
    """Read the case, write its files, tell what they are."""
    from anatomy.case import read_case
    from paravol.output_folder import claimed_folder

    written: dict[str, int] = {}
    is_dicom = ending == "dicom"
    with ProgressReporter() as stages, claimed_folder(out):
        stages("Reading the case", 0.0)
        read = read_case(case)
        stages("Reading the case", 1.0)
        task = "Writing images" if is_dicom else "Writing surfaces"
        made = (
            _images(read, case.resolve().name, out)
            if is_dicom
            else _surfaces(read, out, ending)
        )
        for share, file, count in made:
            stages(task, share)
            written[file] = count
    what = "bytes" if is_dicom else "triangles"
    if as_json:
        print_json({"folder": str(out), what: written, "space": "LPS"})
    elif is_dicom:
        told = [("images and segmentation", f"{len(written)} files")]
        print_table(str(out), [*told, ("size", f"{sum(written.values()):,} bytes")])
    else:
        rows = [(file, f"{count:,} triangles") for file, count in written.items()]
        print_table(str(out), rows)
    return 0


def _surfaces(case: "Case", out: Path, ending: str) -> Iterator[tuple[float, str, int]]:
    from anatomy.files.surfaces import save_surface
    from app.vtk.case_surfaces import case_surfaces

    for share, name, surface in case_surfaces(case):
        file = f"{name.replace(' ', '_')}.{ending}"
        save_surface(surface, out / file)
        yield share, file, len(surface.faces)


def _images(case: "Case", name: str, out: Path) -> Iterator[tuple[float, str, int]]:
    from anatomy.files.dicom_export import write_dicom
    from paravol.versions import versions

    sources = case.record.sources
    names = {int(value): told for value, told in case.record.label_names.items()}
    for share, file in write_dicom(
        *(out, case.ct, case.labels, names, name),
        is_mr=bool(sources) and sources[0].modality == "MR",
        version=versions()["paravol-ess"],
        made=datetime.now().astimezone(),
    ):
        yield share, file.name, file.stat().st_size
