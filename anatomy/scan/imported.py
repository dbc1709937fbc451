"""A head made from a patient's own scan, ready to be flown through."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.queries.landmarks import Landmark
from anatomy.scan.airways import (
    NO_ROOM,
    Airways,
    Opening,
    air_distance,
    box_around,
    find_airways,
    head_distance,
    skin_weight,
)
from anatomy.scan.approach import (
    SHORTEST_MM,
    Approach,
    approach_from,
    check_in_air,
    find_approach,
)
from anatomy.scan.chambers import SINUS_ASIDE_MM, AirSpaces, find_chambers
from anatomy.scan.face_points import FACE_RADIUS_MM, face_points
from anatomy.scan.midplane import Midplane, find_midplane
from anatomy.scan.named_air import NamedAir, name_sinuses
from anatomy.scan.nose_frame import find_nose_frame
from anatomy.scan.scan import Modality, Scan, isotropic, patient_box
from anatomy.tissue import TISSUES, Side, encode_blood
from renderers.scene.volume import Volume
from system import UserError

COARSE_MM = 1.5
"""Voxels for the first look at the whole head."""

MARGIN_MM = 15.0
"""Tissue kept around the airway; a shaft is scored against nothing further away."""

NOSTRIL_RADIUS_MM = 5.0

SINUS_RADIUS_MM = 5.0

NOSTRIL_ASIDE_MM = 15.0
"""From the head's midplane; further out air meets the room at an ear or a cheek."""

NOSTRILS_APART_MM = 15.0
"""In height and depth; lips and chin make openings of a nostril's size as well."""

WIDEST_MM2 = 2000.0
"""A wide open mouth, or a nose that the scan's border cuts, opens over less."""

LARGEST_ML = 60.0
"""Of the pharynx with an open mouth; the cranial vault holds more than a litre."""

BARE = "no soft tissue lies on the bone: it is drawn as bare bone"

AT_NOSTRIL = "the scope enters at a nostril"

ENTRANCE, WAY_END = "entrance", "end of the free way"

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class ImportedHead:
    """A scanned head; but for the face, volumes share one grid of cubic voxels.

    ct: int16 CT numbers. distance: float32 mm to the air surface, negative in air.
    blood, skin: uint8, as a phantom's; a scan does not show blood, so mucosa has the
    mean of healthy ones. named: the air by its places, under a phantom's labels.
    face: float32 mm to the outside of the whole head, negative in the room, on a
    coarse grid of its own. approach: how a scope comes in, None where the scan does not
    tell.
    """

    ct: Volume
    distance: Volume
    blood: Volume
    skin: Volume
    face: Volume
    airways: Airways
    spaces: AirSpaces
    named: NamedAir
    midplane: Midplane
    approach: Approach | None
    landmarks: dict[str, Landmark]
    notes: tuple[str, ...]

    @property
    def labels(self) -> Volume:
        """Return which air each voxel belongs to, uint8 `Label`."""
        return self.named.labels

    @property
    def spacing_mm(self) -> float:
        """Return the edge of the voxels."""
        return float(self.ct.spacing_mm[0])


def import_head(
    scan: Scan,
    spacing_mm: float = 0.5,
    progress: Progress | None = None,
    pivot_mm: NDArray[np.float64] | None = None,
) -> ImportedHead:
    """Find the airway of a scan and build everything a flight needs around it.

    pivot_mm: ``(3,)`` LPS where a scope enters; None takes a nostril, or the most
    promising place where there is none. Raises UserError when the scan shows no
    airway, for a pivot in tissue, or for a spacing outside [0.2, 3] mm.
    """
    if not 0.2 <= spacing_mm <= 3.0:
        raise UserError(f"voxels must be 0.2 to 3 mm wide, got {spacing_mm:g}")

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
    midplane = find_midplane(fine)
    spaces = find_chambers(airways, distance, midplane)
    is_ct = scan.modality is Modality.CT
    # in MR walls of bone are air, and what they part is one
    frame = find_nose_frame(airways, distance, midplane) if is_ct else None
    named = name_sinuses(airways, spaces, distance, midplane, frame, scan.volume)
    report("Finding surfaces", 1.0)
    bare = np.zeros(fine.shape, np.bool_)
    if is_ct:
        bare = bare_bone(fine, distance)
    mucosa, bone = (
        encode_blood(np.array(TISSUES[name].blood_fraction))
        for name in ("mucosa", "bone")
    )
    blood = np.where(bare, bone, mucosa).astype(np.uint8)
    skin = np.where(bare, np.uint8(0), skin_weight(airways))
    ct = np.clip(np.rint(fine.values), -32768, 32767).astype(np.int16)
    doubt = _doubt(airways, spaces, bare)
    nostrils = [] if doubt else _nostrils(airways, midplane)
    if pivot_mm is not None:
        approach: Approach | None = approach_from(distance, pivot_mm)
        check_in_air(distance, airways.labels.values > 0, pivot_mm)
        found = "the scope enters where you said"
    elif doubt:
        approach = None
        found = f"no nostril was found: {doubt}; name the entrance with --pivot x y z"
    else:
        suggested, found = _entrance(nostrils, spaces, distance, midplane)
        is_sure = found == AT_NOSTRIL or is_ct
        approach = suggested if is_sure else None
        if suggested is not None and not is_sure:
            found = (
                "no nostril leads straight in, and in MR bone looks like air: name the "
                "entrance with --pivot x y z; the longest way between the walls begins "
                f"at {np.round(suggested.pivot_mm, 1).tolist()}"
            )
    marks = _landmarks(nostrils, approach)
    for name, place in _face(rough, nostrils, approach, midplane).items():
        marks[name] = Landmark(name, Side.MIDLINE, place, FACE_RADIUS_MM)
    for sinus in named.sinuses:
        if sinus.name:
            mark = Landmark(
                f"{sinus.name} sinus", sinus.side, sinus.center_mm, SINUS_RADIUS_MM
            )
            marks[mark.key] = mark
    room = [note for note in rough.notes if note == NO_ROOM]
    notes = (*scan.notes, *room, *airways.notes, *([BARE] if bare.any() else []), found)
    return ImportedHead(
        ct=fine.with_values(ct, fine.background),
        distance=distance,
        blood=fine.with_values(blood, 0.0),
        skin=fine.with_values(skin, 0.0),
        face=head_distance(rough),
        airways=airways,
        spaces=spaces,
        named=named,
        midplane=midplane,
        approach=approach,
        landmarks=marks,
        notes=tuple(dict.fromkeys(notes)),
    )


def _doubt(airways: Airways, spaces: AirSpaces, bare: NDArray[np.bool_]) -> str | None:
    """Say what about a head's air is not like a nose, so that no way in is guessed."""
    if bare.any():
        return "the head is bare bone"
    widest = max((o.area_mm2 for o in airways.openings), default=0.0)
    if widest > WIDEST_MM2:
        return f"the airway meets the room over {widest:.0f} mm2, as an open skull does"
    middle = [
        c.volume_ml
        for c in spaces.chambers
        if c.is_open and abs(c.aside_mm) < SINUS_ASIDE_MM
    ]
    if max(middle, default=0.0) > LARGEST_ML:
        return (
            f"the airway widens to {max(middle):.0f} mL in the middle of the head, "
            "more than a nose and a throat hold, as an empty skull does"
        )
    return None


def _nostrils(airways: Airways, midplane: Midplane) -> list[Opening]:
    """Choose the openings that are nostrils: in the middle, in front, at one height."""
    openings = [
        o
        for o in airways.openings
        if o.is_nostril and abs(midplane.aside(o.center_mm)) <= NOSTRIL_ASIDE_MM
    ]
    if not openings:
        return []
    first = min(openings, key=lambda o: float(o.center_mm[1])).center_mm
    near = [
        o
        for o in openings
        if np.abs(o.center_mm - first)[1:].max() <= NOSTRILS_APART_MM
    ]
    return near[:2]


def _entrance(
    nostrils: list[Opening],
    spaces: AirSpaces,
    distance: Volume,
    midplane: Midplane,
) -> tuple[Approach | None, str]:
    """Choose the way in; gives it with a sentence that says how it was chosen."""
    ways = [approach_from(distance, opening.center_mm) for opening in nostrils]
    ways = [way for way in ways if way.free_mm >= SHORTEST_MM]
    if ways:
        best = max(ways, key=lambda way: way.free_mm)
        return best, AT_NOSTRIL
    way = find_approach(spaces.passages(), distance, midplane)
    if way is None:
        return None, (
            f"no straight way of {SHORTEST_MM:g} mm leads in beside the septum: name "
            "the entrance with --pivot x y z"
        )
    return way, (
        "no nostril leads straight in: the scope enters where the longest free way "
        "beside the septum begins; name another entrance with --pivot x y z"
    )


def _face(
    rough: Airways,
    nostrils: list[Opening],
    approach: Approach | None,
    midplane: Midplane,
) -> dict[str, NDArray[np.float64]]:
    """Find places of the skin around the nose, wherever that is known to be."""
    if approach is not None:
        return face_points(rough.field, approach.pivot_mm)
    if nostrils:
        return face_points(rough.field, nostrils[0].center_mm)
    middle = rough.field.center_mm
    middle = middle - midplane.aside(middle) * midplane.normal
    return face_points(rough.field, middle)


def _landmarks(
    nostrils: list[Opening], approach: Approach | None
) -> dict[str, Landmark]:
    """Name the way in, and the nostrils if there is one on each side."""
    found = []
    if approach is not None:
        end = approach.pivot_mm + approach.free_mm * approach.axis
        found += [
            Landmark(ENTRANCE, Side.MIDLINE, approach.pivot_mm, NOSTRIL_RADIUS_MM),
            Landmark(WAY_END, Side.MIDLINE, end, NOSTRIL_RADIUS_MM),
        ]
    places = [opening.center_mm for opening in nostrils]
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


BONE_HU = 250.0
"""Above muscle and mucosa with contrast agent."""

DEPTHS_MM = (1.0, 0.5)
"""Below the surface, where voxels hold no air any more; the smaller one where walls
are too thin for the other."""

FEWEST_VOXELS = 1000

BARE_SHARE = 0.6
"""Of what lies so deep; of living heads a third is bone, of skulls nine tenths."""

REACH_MM = 2.0
"""From the surface to where its bone shows in full."""


def bare_bone(ct: Volume, distance: Volume) -> NDArray[np.bool_]:
    """Mark the voxels whose surface is bare bone, ``(nz, ny, nx)``.

    ct: CT numbers on cubic voxels. distance: signed mm to the air surface, negative in
    air, on the same grid. None is marked in a head that has its soft tissue.
    """
    values = np.asarray(ct.values)
    none = np.zeros(values.shape, np.bool_)
    for depth in DEPTHS_MM:
        deep = values[np.asarray(distance.values) > depth]
        if len(deep) >= FEWEST_VOXELS:
            break
    if not len(deep) or np.mean(deep > BONE_HU) < BARE_SHARE:
        return none
    size = 2 * math.ceil(REACH_MM / float(ct.spacing_mm[0])) + 1
    nearest = ndimage.maximum_filter(values, size)
    marked: NDArray[np.bool_] = nearest > BONE_HU
    return marked
