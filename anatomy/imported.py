"""A head made from a patient's own scan, ready to be flown through."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.airways import (
    Airways,
    air_distance,
    box_around,
    find_airways,
    head_distance,
    skin_weight,
)
from anatomy.approach import Approach, approach_from, find_approach
from anatomy.face_points import face_points
from anatomy.landmarks import Landmark
from anatomy.scan import Scan, isotropic, patient_box
from anatomy.tissue import TISSUES, Side, encode_blood
from renderers.scene.volume import Volume

COARSE_MM = 1.5
"""Voxels for the first look at the whole head."""

MARGIN_MM = 15.0
"""Tissue kept around the airway; a shaft is scored against nothing further away."""

NOSTRIL_RADIUS_MM = 5.0
FACE_RADIUS_MM = 1.0

SHORTEST_WAY_MM = 20.0
"""A nostril from which one sees less far is left for a better entrance."""

ENTRANCE, WAY_END = "entrance", "end of the free way"

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class ImportedHead:
    """Hold a scanned head; but for the face, volumes share one grid of cubic voxels.

    ct: int16 CT numbers. distance: float32 mm to the air surface, negative in air.
    blood, skin: uint8, as a phantom's; a scan does not show blood, so mucosa has the
    mean of healthy ones. labels: uint8, 1 the airway, 2 and more separate cavities.
    face: float32 mm to the outside of the whole head, negative in the room, on a
    coarse grid of its own. approach: how a scope comes in.
    """

    ct: Volume
    distance: Volume
    blood: Volume
    skin: Volume
    labels: Volume
    face: Volume
    airways: Airways
    approach: Approach
    landmarks: dict[str, Landmark]
    notes: tuple[str, ...]

    @property
    def spacing_mm(self) -> float:
        """Get the edge of the voxels."""
        return float(self.ct.spacing_mm[0])


def import_head(
    scan: Scan,
    spacing_mm: float = 0.5,
    progress: Progress | None = None,
    pivot_mm: NDArray[np.float64] | None = None,
) -> ImportedHead:
    """Find the airway of a scan and build everything a flight needs around it.

    pivot_mm: ``(3,)`` LPS where a scope enters; None takes a nostril, or the most
    promising place where there is none. Raises ValueError when the scan shows no
    airway, or for a spacing outside [0.2, 3] mm.
    """
    if not 0.2 <= spacing_mm <= 3.0:
        raise ValueError(f"voxels must be 0.2 to 3 mm wide, got {spacing_mm:g}")

    def report(stage: str, share: float) -> None:
        if progress is not None:
            progress(stage, share)

    report("Looking for the airway", 0.0)
    low, high = patient_box(scan.volume)
    rough = find_airways(isotropic(scan.volume, COARSE_MM, low, high))
    report("Looking for the airway", 1.0)
    box = box_around(rough, MARGIN_MM)
    low, high = np.maximum(box[0], low), np.minimum(box[1], high)
    report("Sampling", 0.0)
    fine = isotropic(scan.volume, spacing_mm, low, high)
    outside = isotropic(rough.outside_mm, spacing_mm, low, high)
    report("Sampling", 1.0)
    report("Finding surfaces", 0.0)
    airways = find_airways(fine, outside)
    distance = air_distance(airways)
    report("Finding surfaces", 1.0)
    blood = encode_blood(np.array(TISSUES["mucosa"].blood_fraction))
    ct = np.clip(np.rint(fine.values), -32768, 32767).astype(np.int16)
    approach, found = _approach(airways, distance, pivot_mm)
    marks = _landmarks(airways, approach)
    face = face_points(rough.field, approach.pivot_mm)
    for name, place in face.items():
        marks[name] = Landmark(name, Side.MIDLINE, place, FACE_RADIUS_MM)
    notes = (*scan.notes, *dict.fromkeys((*rough.notes, *airways.notes, found)))
    return ImportedHead(
        fine.with_values(ct, fine.background),
        distance,
        fine.with_values(np.full(fine.shape, blood, np.uint8), 0.0),
        fine.with_values(skin_weight(airways), 0.0),
        airways.labels,
        head_distance(rough),
        airways,
        approach,
        marks,
        notes,
    )


def _approach(
    airways: Airways, distance: Volume, pivot_mm: NDArray[np.float64] | None
) -> tuple[Approach, str]:
    """Choose the way in; gives it with a sentence that says how it was chosen."""
    if pivot_mm is not None:
        return approach_from(distance, pivot_mm), "the scope enters where you said"
    ways = [approach_from(distance, place) for place in airways.openings_mm]
    ways = [way for way in ways if way.free_mm >= SHORTEST_WAY_MM]
    if ways:
        best = max(ways, key=lambda way: way.free_mm)
        return best, "the scope enters at a nostril"
    way = find_approach(airways.labels.values == 1, distance)
    return way, (
        "no nostril leads straight in: the scope enters where the longest free way "
        "begins; name another pivot where that is not the nose"
    )


def _landmarks(airways: Airways, approach: Approach) -> dict[str, Landmark]:
    """Name the way in, and the nostrils if there is one on each side."""
    places = airways.openings_mm[:2]
    end = approach.pivot_mm + approach.free_mm * approach.axis
    found = [
        Landmark(ENTRANCE, Side.MIDLINE, approach.pivot_mm, NOSTRIL_RADIUS_MM),
        Landmark(WAY_END, Side.MIDLINE, end, NOSTRIL_RADIUS_MM),
    ]
    if len(places) == 2:
        # +x is the patient's left
        right, left = sorted(places, key=lambda place: float(place[0]))
        found += [
            Landmark("nostril", Side.RIGHT, right, NOSTRIL_RADIUS_MM),
            Landmark("nostril", Side.LEFT, left, NOSTRIL_RADIUS_MM),
        ]
    elif places:
        found += [Landmark("nostrils", Side.MIDLINE, places[0], NOSTRIL_RADIUS_MM)]
    return {landmark.key: landmark for landmark in found}
