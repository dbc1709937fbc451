"""Parts of a head by name and side: what is to be taken, or spared, of how much.

A structure is a part of its own. The ethmoid's are the walls between its cells
and to the nose: those of the bulla, and of all other cells before the basal lamella, of
which those behind the bulla's middle are a part of their own.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from renderers.scene import Volume
from scenarios.coverage.sites import SIDES, middle_of
from scenarios.structures import NAMES, Structures

BULLA, CELLS = "ethmoid bulla", "anterior ethmoid cells"
RETROBULLAR = "retrobullar cells"
CELL_AIR = "anterior ethmoid air"
BESIDE = ("nasal air", "variant cell air")
"""Rooms that a cell's wall may part it from, beside other cells."""

SHUT, OPEN = -1, 1
"""Rooms by number: of others nothing is parted; those of `BESIDE`, then the cells."""

WALL_MM = 2.0
"""Such walls are at most this thick, with their mucosa."""

OSTIUM_MM = 1.4
"""Cells are told apart where a ball of this radius does not pass."""

PART_NAMES = tuple(
    f"{name}, {side}"
    for name in (*dict.fromkeys(NAMES.values()), BULLA, CELLS, RETROBULLAR)
    for side in SIDES
)

FULL = 65535.0
Voxels = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class HeadPart:
    """A part's voxels, flat, and how much of them was tissue at first."""

    voxels: Voxels
    was: float

    def taken_percent(self, fill: NDArray[np.uint16]) -> float:
        """Return how much was taken; fill: what is left of the head's voxels."""
        left = float(fill.reshape(-1)[self.voxels].sum(dtype=np.int64)) / FULL
        return 100.0 * min(max(1.0 - left / self.was, 0.0), 1.0)


@dataclass(frozen=True)
class Head:
    """A head before anybody operated.

    distance: signed air distance, mm, negative in air. structures: what names places;
    None where nobody knows.
    """

    distance: Volume
    structures: Structures | None = None

    def part(self, name: str) -> HeadPart | None:
        """Return a part such as ``ethmoid bulla, right``; None where there is none."""
        what, _, side = name.partition(", ")
        if self._middle_mm is None or side not in SIDES:
            return None
        if what in (BULLA, CELLS, RETROBULLAR):
            chosen = self._cell_walls(what, side)
        else:
            chosen = self._structure(what, side)
        values = self.distance.values.reshape(-1)[chosen]
        share = np.clip(0.5 + values / self.distance.spacing_mm.max(), 0.0, 1.0)
        was = float(share.sum())
        return HeadPart(chosen[share > 0.0], was) if was > 0.0 else None

    @cached_property
    def _middle_mm(self) -> float | None:
        """Return x of the midline; None where nothing tells parts and sides."""
        known = self.structures
        if known is None or known.labels.shape != self.distance.shape:
            return None
        return middle_of(known.landmarks)

    def places(self, voxels: Voxels) -> NDArray[np.float64]:
        """Return where voxels lie, ``(n, 3)`` LPS mm."""
        k, j, i = np.unravel_index(voxels, self.distance.shape)
        matrix = self.distance.world_from_voxel
        places: NDArray[np.float64] = (
            np.stack([i, j, k], axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
        )
        return places

    def _on(self, side: str, voxels: Voxels) -> Voxels:
        """Return those voxels that lie on a side."""
        is_left = self.places(voxels)[:, 0] > (self._middle_mm or 0.0)
        chosen: Voxels = voxels[is_left == (side == "left")]
        return chosen

    def _structure(self, what: str, side: str) -> Voxels:
        assert self.structures is not None
        names = self.structures.names
        values = [value for value, name in names.items() if name == what]
        labelled = np.isin(self.structures.labels.values, values)
        return self._on(side, np.flatnonzero(labelled))

    def _cell_walls(self, what: str, side: str) -> Voxels:
        """Return the walls of the bulla, or of other cells before the lamella."""
        assert self.structures is not None
        known = self.structures
        labels, values = known.labels.values, self.distance.values
        value_of = {name: value for value, name in known.airs.items()}
        bulla = known.landmarks.get(f"{BULLA}, {side}")
        cells = np.flatnonzero(labels == value_of.get(CELL_AIR, -1))
        cells = self._on(side, cells)
        if bulla is None or not len(cells):
            return np.zeros(0, np.int64)
        steps = round(WALL_MM / float(self.distance.spacing_mm.max()))
        at = np.stack(np.unravel_index(cells, labels.shape))
        low = np.maximum(at.min(axis=1) - steps, 0)
        high = np.minimum(at.max(axis=1) + steps + 1, labels.shape)
        k, j, i = (slice(a, b) for a, b in zip(low, high, strict=True))
        labels, values = labels[k, j, i], values[k, j, i]
        is_spared = np.isin(labels, list(known.names))
        rooms = np.where((values < 0.0) | is_spared, SHUT, 0)
        for name in BESIDE:
            rooms[(values < 0.0) & (labels == value_of.get(name, -1))] = OPEN
        is_cell = np.zeros(rooms.shape, bool)
        is_cell[tuple(at - low[:, None])] = True
        cores, _ = ndimage.label(is_cell & (values < -OSTIUM_MM))
        if not cores.any():
            return np.zeros(0, np.int64)
        number = _spread(cores)
        rooms[is_cell] = OPEN + number[is_cell]
        matrix = self.distance.voxel_from_world
        middle = (matrix[:3, :3] @ bulla + matrix[:3, 3])[::-1] - low
        a, b, c = np.clip(np.rint(middle), 0, np.array(rooms.shape) - 1).astype(int)
        own = OPEN + number[a, b, c]
        found = np.zeros((2, *rooms.shape), bool)
        for axis in range(3):
            one, two = (_met(rooms, axis, steps, way) for way in (1, -1))
            parts = (one > 0) & (two > 0) & (one != two)
            is_own = (one == own) | (two == own)
            found |= np.stack([parts & is_own, parts & ~is_own])
        wall = found[0] if what == BULLA else found[1] & ~found[0]
        wall &= rooms == 0
        inside = np.argwhere(wall) + low
        flat = np.ravel_multi_index(tuple(inside.T), self.distance.shape)
        found_walls = self._on(side, flat.astype(np.int64))
        if what == RETROBULLAR:
            is_behind = self.places(found_walls)[:, 1] > bulla[1]
            found_walls = found_walls[is_behind]
        return found_walls


def _spread(cores: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return everywhere the number of the nearest core; 0 is none."""
    nearest = ndimage.distance_transform_edt(
        cores == 0, return_distances=False, return_indices=True
    )
    found: NDArray[np.int32] = cores[tuple(nearest)]
    return found


def _met(
    rooms: NDArray[np.int64], axis: int, steps: int, way: int
) -> NDArray[np.int64]:
    """Return the first room that is met along an axis, 0 for none so near."""
    found = np.zeros_like(rooms)
    ahead = np.moveaxis(rooms, axis, 0)[::way]
    target = np.moveaxis(found, axis, 0)[::way]
    for step in range(1, steps + 1):
        part = target[:-step]
        part[part == 0] = ahead[step:][part == 0]
    return found
