"""The commands about patients: phantoms, imported scans, pictures of them.

Nothing heavy is imported here: every command fetches its own modules when it runs.
"""

from pathlib import Path
from typing import Literal

from app.cli.root import PATIENTS, Flag, Json, Place, Seed, app


@app.command(name="import", group=PATIENTS)
def import_scan(
    scan: Path,
    *,
    out: Path,
    series: int | None = None,
    modality: Literal["ct", "mr"] | None = None,
    spacing: float = 0.5,
    pivot: Place | None = None,
    second: Path | None = None,
    allow_gaps: Flag = False,
    nonfinite_air: Flag = False,
    force: Flag = False,
    json: Json = False,
) -> int:
    """Make a case of a patient's own CT or MR, to be flown through.

    The airway, its cavities and its openings are found by themselves; fly with
    paravol train --case DIR.

    Parameters
    ----------
    scan
        A DICOM folder, or an NRRD, NIfTI or MetaImage file.
    out
        Folder for the case, which 3D Slicer opens.
    series
        Which series of a folder that holds several.
    modality
        What the numbers mean, where the file does not say and the guess is wrong.
    spacing
        Voxel edge in millimetres.
    pivot
        Where the scope enters: x y z in millimetres, patient LPS; a nostril when
        left out.
    second
        A second scan of the same head, CT or MR; it is registered to the first.
    allow_gaps
        Bridge missing slices by interpolation.
    nonfinite_air
        Take voxels that are no numbers for air.
    force
        Write over the case, and its exercise, that the folder holds.
    """
    from app.cli.import_command import run_import
    from paravol.case_import import ImportOptions

    options = ImportOptions(
        scan,
        out,
        series,
        modality,
        spacing,
        pivot,
        second,
        allow_gaps,
        nonfinite_air,
        force,
    )
    return run_import(options, as_json=json)


@app.command(group=PATIENTS)
def phantom(
    *,
    out: Path,
    seed: Seed = 1,
    average: bool = False,
    variant: tuple[str, ...] = (),
    without: tuple[str, ...] = (),
    lund_mackay: tuple[str, ...] = (),
    spacing: float = 0.5,
    noise: float = 12.0,
    mr: bool = False,
    force: Flag = False,
    json: Json = False,
) -> int:
    """Write a virtual patient as a case folder that 3D Slicer opens.

    Parameters
    ----------
    out
        Folder for ct.nrrd, labels.seg.nrrd, landmarks.mrk.json and case.json.
    seed
        Draws a patient: sizes, septum, skull base, cells and variants.
    average
        Take the average adult instead; the seed then draws the cells alone.
    variant
        Add a variant, such as onodi:left, haller or keros-3; may be repeated.
    without
        Remove a variant, such as agger-nasi:right; may be repeated.
    lund_mackay
        Add disease, such as maxillary:left=2,ostiomeatal:left=2 or polyps=3.
    spacing
        Voxel edge in millimetres.
    noise
        Standard deviation of the CT's noise in HU: 12 is a soft kernel, 50 a bone one.
    mr
        Write t1.nrrd and t2.nrrd too.
    force
        Write over the case that the folder holds.
    """
    from app.cli.phantom_command import run_phantom

    return run_phantom(
        out=out,
        seed=seed,
        spacing_mm=spacing,
        as_json=json,
        average=average,
        variants=variant,
        without=without,
        lund_mackay=lund_mackay,
        noise_hu=noise,
        resonance=mr,
        force=force,
    )


@app.command(group=PATIENTS)
def export(
    case: Path,
    *,
    out: Path,
    format: Literal["ply", "vtp", "stl"] = "ply",
    json: Json = False,
) -> int:
    """Write a case's surfaces for other programs, in patient LPS millimetres.

    Parameters
    ----------
    case
        A case folder, as import and phantom write.
    out
        Folder for the surfaces: air, skin, and each cavity or structure.
    format
        PLY for printers and viewers, VTP for ParaView and 3D Slicer, STL for printers.
    """
    from app.cli.export_command import run_export

    return run_export(case=case, out=out, ending=format, as_json=json)


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
