"""The commands about patients: phantoms, imported scans, pictures of them.

Nothing heavy is imported here: every command fetches its own modules when it runs.
"""

from pathlib import Path
from typing import Annotated, Literal

from app.cli.exchange_command import PathOptions
from app.cli.root import (
    FLATTENED,
    PATIENTS,
    SESSIONS,
    Json,
    Place,
    Seed,
    Threads,
    app,
    thread_count,
)
from disk import UserError
from paravol.case_options import ImportOptions, PhantomOptions


@app.command(name="import", group=PATIENTS)
def import_scan(
    scan: Path, *, options: Annotated[ImportOptions, FLATTENED], json: Json = False
) -> int:
    """Make a case of a patient's own CT or MR, to be flown through.

    The airway, its cavities and its openings are found by themselves; fly with
    paravol train --case DIR.

    Parameters
    ----------
    scan
        A DICOM folder, or an NRRD, NIfTI or MetaImage file.
    """
    from app.cli.import_command import run_import

    return run_import(scan, options, as_json=json)


@app.command(group=PATIENTS)
def phantom(
    *,
    options: Annotated[PhantomOptions, FLATTENED],
    seed: Seed = 1,
    json: Json = False,
) -> int:
    """Write a virtual patient as a case folder that 3D Slicer opens.

    Parameters
    ----------
    seed
        Draws a patient: sizes, septum, skull base, cells and variants.
    """
    from app.cli.phantom_command import run_phantom

    return run_phantom(seed, options, as_json=json)


@app.command(group=PATIENTS)
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
        from app.cli.exchange_command import run_session_export

        return run_session_export(case, out, format, as_json=json)
    if is_session:
        raise UserError(
            f"{case} is a session; say with --format perktutor, seq or csv how."
        )
    from app.cli.export_command import run_export

    return run_export(case=case, out=out, ending=format, as_json=json)


@app.command(group=SESSIONS)
def path(
    recording: Path, *, options: Annotated[PathOptions, FLATTENED], json: Json = False
) -> int:
    """Make a path that can be flown of a recording, another program's or our own.

    Parameters
    ----------
    recording
        PerkTutor's .xml, a .seq.mha, .igs.mha or .seq.nrrd of 3D Slicer or PLUS, or a
        session, NAME.paravol.
    """
    from app.cli.exchange_command import run_path

    return run_path(recording, options, as_json=json)


@app.command(group=PATIENTS)
def face(
    surface: Path,
    *,
    case: Path,
    landmarks: Path,
    out: Path | None = None,
    json: Json = False,
) -> int:
    """Lay a scanned face, such as a mock head's, onto the skin of a case.

    Parameters
    ----------
    surface
        PLY or STL file of the face, in millimetres.
    case
        The case whose skin it is.
    landmarks
        A .mrk.json file with at least three landmarks on the face, named as in the
        case (face 1, face 2, ...).
    out
        The aligned surface, .ply or .vtp; a .tfm for ITK lands beside it.
    """
    from app.cli.face_command import run_face

    return run_face(
        surface=surface, case=case, landmarks=landmarks, out=out, as_json=json
    )


@app.command(group=PATIENTS)
def slices(
    case: Path,
    *,
    at: Place | None = None,
    show: Literal["ct", "mr", "both"] = "ct",
    labels: Literal["outlines", "tint", "none"] = "outlines",
    out: Path | None = None,
    json: Json = False,
) -> int:
    """Draw three planes of a case, and its histogram with the transfer function.

    Parameters
    ----------
    case
        A case folder, as import and phantom write.
    at
        Point the planes go through: x y z in millimetres, patient LPS; the entrance
        when left out.
    show
        The CT, the second scan, or bone from the CT over soft tissue from the MR.
    labels
        What was found, passages and cavities or a phantom's structures, as outlines, as
        a light tint, or not at all; a legend below names the colours.
    out
        PNG file to write; slices.png in the case when left out.
    """
    from app.cli.slices_command import run_slices

    return run_slices(case=case, at=at, show=show, labels=labels, out=out, as_json=json)


@app.command(group=PATIENTS)
def volume(
    case: Path | None = None, *, look: Path | None = None, threads: Threads = 0
) -> int:
    """Show a scan whole in a window: as a volume whose look is edited, or a surface.

    Parameters
    ----------
    case
        A case folder, as import and phantom write; the bundled head when left out.
    look
        A file that the window saved: transfer function, threshold and lights.
    """
    from app.cli.volume_window import run_volume

    return run_volume(case, look, thread_count(threads))
