"""Where a scanned or printed face belongs on a patient's skin: landmarks, then ICP.

The paper's mock head is such a face: its surface comes from a scanner or a printer's
file, in a frame of its own, and has to lie where the patient's skin lies.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.files.surfaces import Surface
from devices import Registration, register
from devices.registration.surface_fit import Landmarks, refine
from paravol.registration.skin import Skin
from system import UserError

LANDMARK_MM = 2.0
"""How well a person puts the same landmark on two faces."""

SKIN_MM = 0.5

LARGEST_LANDMARK_RMS_MM = 8.0
"""Beyond this the landmarks are confused, not merely coarse."""

NEAR_MM = 8.0
"""Points that the landmarks leave further from the skin are not face."""

SLOPES = (0.5, 1.6)
"""Of a signed distance, within sampling."""

MOST_POINTS = 4000
FEWEST_SHARE = 0.3
ROUNDS = 3


@dataclass(frozen=True, slots=True, eq=False)
class FaceFit:
    """Where the face lies and how well it fits.

    patient_from_face: 4x4. landmark_rms_mm: at the landmarks, before refining.
    surface_rms_mm: of the points that are face. used: their share.
    """

    patient_from_face: NDArray[np.float64]
    landmark_rms_mm: float
    surface_rms_mm: float
    used: float


class WholeSkin(Skin):
    """Leave out where a scan ends: there its distance jumps and has no direction."""

    def normal(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return unit normals ``(n, 3)``, zero where there is no skin to speak of."""
        slope = super().normal(points)
        steepness = np.linalg.norm(slope, axis=1, keepdims=True)
        low, high = SLOPES
        sure = (steepness > low) & (steepness < high)
        unit: NDArray[np.float64] = np.where(
            sure, slope / np.maximum(steepness, low), 0
        )
        return unit


def register_face(
    face: Surface,
    on_face: Mapping[str, NDArray[np.float64]],
    on_patient: Mapping[str, NDArray[np.float64]],
    skin: Skin,
) -> FaceFit:
    """Lay a face onto the skin of a patient.

    on_face, on_patient: landmarks ``(3,)`` by name; at least three names in both.
    skin: signed distance, negative in air. Raises RegistrationError, or UserError
    with the figure that is bad, when they do not fit.
    """
    names = [name for name in on_face if name in on_patient]
    if len(names) < 3:
        raise UserError(
            f"The face and the patient share {len(names)} landmarks "
            f"({', '.join(names) or 'none'}); at least 3 of the same name are needed."
        )
    theirs = np.stack([on_face[name] for name in names])
    mine = np.stack([on_patient[name] for name in names])
    start: Registration = register(theirs, mine, names, LARGEST_LANDMARK_RMS_MM)
    weights = np.repeat(np.eye(3)[None] / LANDMARK_MM**2, len(names), axis=0)
    landmarks = Landmarks(theirs, mine, weights)
    points = _spread(face.vertices)
    transform, whole = start.world_from_device, WholeSkin(skin.field)
    fit, used = 0.0, np.zeros(len(points), bool)
    near = 2 * NEAR_MM
    for _ in range(ROUNDS):
        lying = points @ transform[:3, :3].T + transform[:3, 3]
        used = np.abs(skin.distance(lying)) < min(near, NEAR_MM)
        if used.mean() < FEWEST_SHARE:
            raise UserError(
                f"Only {used.mean():.0%} of the face lies within {NEAR_MM:g} mm of the "
                "patient's skin; check the landmarks and the unit (millimetres)."
            )
        refined = refine(transform, landmarks, points[used], whole, SKIN_MM)
        transform, fit = refined.world_from_device, refined.surface_rms_mm
        # what is not face (hair, a stand) is left out more and more strictly
        near = max(4 * fit, 1.0)
    return FaceFit(transform, start.residual_rms_mm, fit, float(used.mean()))


def _spread(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points spread evenly through the list, always the same ones."""
    return vertices[:: max(len(vertices) // MOST_POINTS, 1)]
