"""`paravol face`: a scanned face onto a case's skin."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from anatomy.case import read_case
from anatomy.files import write_file
from anatomy.markups import read_markups
from anatomy.surfaces import load_surface, save_surface
from app.face_registration import register_face
from app.skin import Skin
from app.terminal import Stages, print_json, print_table


def run_face(
    *, surface: Path, case: Path, landmarks: Path, out: Path | None, as_json: bool
) -> int:
    """Register, write, tell how well it fits."""
    face = load_surface(surface)
    marks = {n: m.position_mm for n, m in read_markups(landmarks).items()}
    with Stages() as stages:
        stages("Reading the case", 0.0)
        read = read_case(case)
        stages("Reading the case", 1.0)
        skin = read.volumes.get("face") or read.volumes.get("distance")
        if skin is None:
            raise ValueError(
                f"The case {case} has no skin; make it again with paravol import."
            )
        places = {n: m.position_mm for n, m in read.landmarks.items()}
        stages("Laying the face onto the skin", 0.0)
        fit = register_face(face, marks, places, Skin(skin))
        stages("Laying the face onto the skin", 1.0)
    if out is not None:
        save_surface(face.moved(fit.patient_from_face), out)
        write_file(out.with_suffix(".tfm"), tfm_text(fit.patient_from_face).encode())
    figures = {
        "landmark_rms_mm": fit.landmark_rms_mm,
        "surface_rms_mm": fit.surface_rms_mm,
        "used": fit.used,
    }
    if as_json:
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


def tfm_text(patient_from_face: NDArray[np.float64]) -> str:
    """Write a transform as an ITK text file.

    ITK's transforms take a point of the output to one of the input: the file holds the
    face's place of a patient's point.
    """
    face_from_patient = np.linalg.inv(patient_from_face)
    numbers = (*face_from_patient[:3, :3].ravel(), *face_from_patient[:3, 3])
    return (
        "#Insight Transform File V1.0\n#Transform 0\n"
        "Transform: AffineTransform_double_3_3\n"
        f"Parameters: {' '.join(repr(float(v)) for v in numbers)}\n"
        "FixedParameters: 0 0 0\n"
    )
