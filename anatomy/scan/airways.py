"""The air of a scanned head: what is outside, what is the airway, what are cavities.

A nostril is a hole in the head, so the airway and the room are one connected air. They
are separated by width: a ball of 8 mm radius rolls everywhere outside and nowhere
inside the nose.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.redistance import DEEPEST_MM, FARTHEST_MM, redistance
from anatomy.tissue import SURFACE_HU
from renderers.scene.volume import AIR_HU, Volume
from system import UserError, simple_itk

BALL_MM = 8.0
"""Radius that nostrils and meatus are narrower than."""

ROOM_CONTACT_MM2 = 3000.0
"""Area of the scan's border that the air of the room covers at least; a pharynx that
is cut by the lowest slice covers less."""

SPECK_MM3 = 15.0
"""Air in tissue, or tissue in air, of less volume is noise."""

CAVITY_MM3 = 100.0
"""Air cells from this size are listed."""

NOSTRIL_MM2 = (12.0, 450.0)
"""Areas that the opening of one or of both nostrils can have."""

FAR_MM = 1000.0
"""To the room of a scan that shows none: it is interpolated, so it is finite."""

NO_ROOM = "no air of the room is in the scan"

MIDDLE_MM = 25.0
"""Half width of the slab about the middle of the head that holds the nasal airway."""

SKIN_MM = (2.0, 9.0)
"""Depth from the outside over which dry skin gives way to mucosa."""


@dataclass(frozen=True, slots=True)
class Cavity:
    """Describe one air space apart from the airway: where, and how large."""

    center_mm: NDArray[np.float64]
    volume_ml: float


@dataclass(frozen=True, slots=True)
class Opening:
    """Describe one place where the airway meets the room; LPS mm, mm2."""

    center_mm: NDArray[np.float64]
    area_mm2: float

    @property
    def is_nostril(self) -> bool:
        """Return whether one nostril, or both together, can be so large."""
        low, high = NOSTRIL_MM2
        return low <= self.area_mm2 <= high


@dataclass(frozen=True, slots=True)
class Airways:
    """What was found.

    field: float32 CT numbers above those of the surface, negative in air, without the
    specks of noise. outside_mm: float32,
    distance to the air of the room, 0 in it. labels: uint8; 0 is no inner air, 1 the
    airway, 2 and more the cavities in their order. openings: where the airway meets
    the room, largest first.
    """

    field: Volume
    outside_mm: Volume
    labels: Volume
    cavities: tuple[Cavity, ...]
    openings: tuple[Opening, ...]
    airway_ml: float
    notes: tuple[str, ...]


def find_airways(ct: Volume, outside: Volume | None = None) -> Airways:
    """Find the air of a head in CT numbers on cubic voxels.

    outside: distance to the room on the same grid, where a coarser look at the whole
    head has found it; a piece of a head does not show its own outside. Raises
    UserError when there is no air inside the head.
    """
    spacing = float(ct.spacing_mm[0])
    if not np.allclose(ct.spacing_mm, spacing):
        raise UserError(f"the airway needs cubic voxels, got {ct.spacing_mm} mm")
    field = np.asarray(ct.values, dtype=np.float32) - np.float32(SURFACE_HU)
    _remove_specks(field, spacing)
    air = field < 0
    notes = []
    if outside is None:
        core = _room(_distance_to(~air, spacing) > BALL_MM, spacing)
        if core.any():
            reach = _distance_to(core, spacing)
        else:
            reach = np.full(air.shape, FAR_MM, np.float32)
            notes.append(NO_ROOM)
        # what the ball covers with its centre in the core, and a voxel for rounding
        away = np.maximum(reach - np.float32(BALL_MM + spacing), 0)
    else:
        away = np.asarray(outside.values, dtype=np.float32)
    room = air & (away <= 0)
    inner = air & ~room
    parts, count = ndimage.label(inner)
    sizes = np.bincount(parts.ravel(), minlength=count + 1) * spacing**3
    sizes[0] = 0
    if count == 0 or sizes.max() < CAVITY_MM3:
        raise UserError(
            "there is no air inside the head: is it a scan of the nose, and are its "
            "numbers CT numbers?"
        )
    openings = _openings(parts, room, spacing)
    main = _airway(field >= 0, parts, sizes)
    others = [int(p) for p in np.argsort(-sizes) if sizes[p] >= CAVITY_MM3]
    others = [p for p in others if p != main][: 255 - 1]
    names = np.zeros(count + 1, np.uint8)
    names[main] = 1
    names[others] = np.arange(2, len(others) + 2)
    labels = names[parts]
    middles = part_middles(parts)
    cavities = [
        Cavity(ct.origin_mm + middles[p][::-1] * spacing, float(sizes[p]) / 1000)
        for p in others
    ]
    places = tuple(
        Opening(ct.origin_mm + place[::-1] * spacing, area)
        for area, place in openings.get(main, [])
    )
    if places and places[0].area_mm2 > NOSTRIL_MM2[1]:
        notes.append(
            f"the airway opens to the room over {places[0].area_mm2:.0f} mm2, more "
            "than nostrils do: the face may be cut off"
        )
    if not any(place.is_nostril for place in places):
        notes.append("no nostril was found: the airway is closed, or the face is cut")
    return Airways(
        ct.with_values(field, AIR_HU - SURFACE_HU),
        ct.with_values(away, 0.0),
        ct.with_values(labels, 0.0),
        tuple(cavities),
        places,
        float(sizes[main]) / 1000,
        tuple(notes),
    )


def air_distance(airways: Airways) -> Volume:
    """Return the signed distance to the air surface: float32 mm, negative in air."""
    field = airways.field
    distance = redistance(field.values, float(field.spacing_mm[0]))
    return field.with_values(distance, FARTHEST_MM)


def head_distance(airways: Airways) -> Volume:
    """Return the signed distance to the head's outside: mm, negative in the room.

    Air inside the head counts as tissue, so that only skin is a surface.
    """
    field = np.asarray(airways.field.values)
    inner = (field < 0) & (airways.outside_mm.values > 0)
    closed = np.where(inner, np.float32(-SURFACE_HU), field)
    distance = redistance(closed, float(airways.field.spacing_mm[0]))
    return airways.field.with_values(distance, DEEPEST_MM)


def skin_weight(airways: Airways) -> NDArray[np.uint8]:
    """Return 255 at the face and 0 deep inside the nose."""
    shallow, deep = SKIN_MM
    t = np.clip((deep - airways.outside_mm.values) / (deep - shallow), 0, 1)
    result: NDArray[np.uint8] = np.rint(255 * t * t * (3 - 2 * t)).astype(np.uint8)
    return result


def box_around(airways: Airways, margin_mm: float) -> NDArray[np.float64]:
    """Return corners ``(2, 3)`` LPS of a box around the airway and what is beside it.

    Cavities count whose middle lies within the margin of the airway's own box.
    """
    boxes = ndimage.find_objects(airways.labels.values)
    grid = airways.labels

    def corners(box: tuple[slice, ...]) -> NDArray[np.float64]:
        ends = np.array([[s.start for s in box], [s.stop - 1 for s in box]])
        return grid.origin_mm + ends[:, ::-1] * grid.spacing_mm

    low, high = corners(boxes[0]) + np.array([[-margin_mm], [margin_mm]])
    near = [np.stack([low, high])]
    for cavity, box in zip(airways.cavities, boxes[1:], strict=True):
        if np.all((cavity.center_mm > low) & (cavity.center_mm < high)):
            near.append(corners(box) + np.array([[-margin_mm], [margin_mm]]) / 3)
    return np.stack([np.min(near, axis=(0, 1)), np.max(near, axis=(0, 1))])


def part_middles(parts: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the mean index z y x of each numbered part, ``(n + 1, 3)``; row 0 is none.

    One pass over the marked voxels instead of one over all for each sum.
    """
    places = np.nonzero(parts)
    numbers = parts[places]
    count = np.maximum(np.bincount(numbers), 1)
    return np.stack([np.bincount(numbers, axis) / count for axis in places], axis=1)


def _remove_specks(field: NDArray[np.float32], spacing: float) -> None:
    """Turn the sign of what is too small to be anatomy, in place."""
    most = SPECK_MM3 / spacing**3
    for air in (True, False):
        parts, count = ndimage.label((field < 0) == air)
        if count < 2:
            continue
        sizes = np.bincount(parts.ravel())
        small = sizes < most
        small[0] = False
        specks = small[parts]
        # a CT number on the other side of the surface, but close to it
        field[specks] = 1.0 if air else -1.0


def _distance_to(mask: NDArray[np.bool_], spacing: float) -> NDArray[np.float32]:
    """Return the distance in mm to the nearest marked voxel, 0 in it."""
    sitk = simple_itk()
    image = sitk.GetImageFromArray(mask.astype(np.uint8))
    distance = sitk.SignedMaurerDistanceMap(image, False, False, False)
    values: NDArray[np.float32] = sitk.GetArrayFromImage(distance)
    return np.maximum(values, 0) * np.float32(spacing)


def _room(core: NDArray[np.bool_], spacing: float) -> NDArray[np.bool_]:
    """Keep the parts of the core that cover much of the scan's border."""
    parts, count = ndimage.label(core)
    contact = np.zeros(count + 1)
    for axis in range(3):
        for end in (0, -1):
            contact += np.bincount(
                np.take(parts, end, axis=axis).ravel(), minlength=count + 1
            )
    contact[0] = 0
    room: NDArray[np.bool_] = (contact * spacing**2 >= ROOM_CONTACT_MM2)[parts]
    return room


def _openings(
    parts: NDArray[np.int32], room: NDArray[np.bool_], spacing: float
) -> dict[int, list[tuple[float, NDArray[np.float64]]]]:
    """List, for each part of the inner air, areas and places where it meets the room.

    Areas in mm2, largest first; places in voxels z, y, x.
    """
    touching = (parts > 0) & ndimage.binary_dilation(room)
    patches, _ = ndimage.label(touching, np.ones((3, 3, 3)))
    found: dict[int, list[tuple[float, NDArray[np.float64]]]] = {}
    for patch, where in enumerate(ndimage.find_objects(patches), start=1):
        here = patches[where] == patch
        owner = int(parts[where][here][0])
        start = np.array([s.start for s in where])
        place = start + np.argwhere(here).mean(axis=0)
        found.setdefault(owner, []).append((float(here.sum()) * spacing**2, place))
    for listed in found.values():
        listed.sort(key=lambda item: -item[0])
    return found


def _airway(
    tissue: NDArray[np.bool_], parts: NDArray[np.int32], sizes: NDArray[np.floating]
) -> int:
    """Choose the airway: the part with most air near the middle of the head."""
    across = tissue.sum(axis=(0, 1))
    middle = float(np.average(np.arange(len(across)), weights=across))
    spacing = (sizes.sum() / max(np.count_nonzero(parts), 1)) ** (1 / 3)
    low = max(int(middle - MIDDLE_MM / spacing), 0)
    high = int(middle + MIDDLE_MM / spacing) + 1
    near = np.bincount(parts[:, :, low:high].ravel(), minlength=len(sizes))
    near[0] = -1
    return int(near.argmax())
