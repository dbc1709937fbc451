"""`paravol face`: a scanned face onto a case's skin."""

from pathlib import Path

from app.cli.root import Json
from app.cli.terminal import ProgressReporter, print_json, print_table
from system import UserError


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
    from anatomy.case import read_case
    from anatomy.files.markups import read_markups
    from anatomy.files.surfaces import load_surface, save_surface
    from devices.registration.registration_file import save_itk_transform
    from paravol.registration.face_fit import register_face
    from paravol.registration.skin import Skin

    if out is not None and out.suffix.lower() not in (".ply", ".vtp"):
        raise UserError(f"--out must name a .ply or .vtp file, got {out}.")
    face = load_surface(surface)
    marks = {n: m.position_mm for n, m in read_markups(landmarks).items()}
    with ProgressReporter() as stages:
        stages("Reading the case", 0.0)
        read = read_case(case)
        stages("Reading the case", 1.0)
        skin = read.volumes.get("face") or read.volumes.get("distance")
        if skin is None:
            raise UserError(
                f"The case {case} has no skin; make it again with paravol import."
            )
        places = {n: m.position_mm for n, m in read.landmarks.items()}
        stages("Laying the face onto the skin", 0.0)
        fit = register_face(face, marks, places, Skin(skin))
        stages("Laying the face onto the skin", 1.0)
    if out is not None:
        save_surface(face.moved(fit.patient_from_face), out)
        save_itk_transform(out.with_suffix(".tfm"), fit.patient_from_face)
    figures = {
        "landmark_rms_mm": fit.landmark_rms_mm,
        "surface_rms_mm": fit.surface_rms_mm,
        "used": fit.used,
    }
    if json:
        matrix = fit.patient_from_face.tolist()
        print_json({**figures, "patient_from_face": matrix})
    else:
        rows = [
            ("landmarks", f"{fit.landmark_rms_mm:.2f} mm rms"),
            ("surface", f"{fit.surface_rms_mm:.2f} mm rms"),
            ("used", f"{fit.used:.0%} of the face"),
        ]
        print_table(str(surface), rows)
    return 0
