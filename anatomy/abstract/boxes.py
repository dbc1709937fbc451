"""Spaces cut out of solid by boxes along the axes, with exact distances.

The planes of all boxes cut the world into cells. Air and solid are each covered by
boxes of whole cells, so both distances are those to the nearest of some boxes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

Box = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
"""Ranges of x, y and z, mm; they may be infinite."""


@dataclass(frozen=True, slots=True)
class BoxSpace:
    """A space and what is around it as boxes, which may overlap."""

    air: tuple[Box, ...]
    solid: tuple[Box, ...]

    @classmethod
    def of(cls, rooms: Sequence[Box], blocks: Sequence[Box] = ()) -> "BoxSpace":
        """Cut rooms out of solid, then put blocks into them."""
        ends = np.array([*rooms, *blocks]).transpose(1, 0, 2).reshape(3, -1)
        planes = [np.unique([-np.inf, *at, np.inf]) for at in ends]
        is_air = np.zeros([len(p) - 1 for p in planes], np.bool_)
        for boxes, value in ((rooms, True), (blocks, False)):
            for box in boxes:
                is_air[_cells(box, planes)] = value
        return cls(_covered(is_air, planes), _covered(~is_air, planes))

    def distance_mm(self, x: Doubles, y: Doubles, z: Doubles) -> Doubles:
        """Return the signed distance to the surface, mm, negative in air.

        x, y, z: mm; they are broadcast.
        """
        to_air, to_solid = (
            np.sqrt(_nearest_square(boxes, (x, y, z)))
            for boxes in (self.air, self.solid)
        )
        signed: Doubles = to_air - to_solid
        return signed


def _cells(box: Box, planes: list[Doubles]) -> tuple[slice, ...]:
    return tuple(
        slice(*np.searchsorted(plane, range_mm).tolist())
        for plane, range_mm in zip(planes, box, strict=True)
    )


def _covered(wanted: NDArray[np.bool_], planes: list[Doubles]) -> tuple[Box, ...]:
    """Cover the wanted cells by boxes that no direction lets grow."""
    left, boxes = wanted.copy(), []
    while left.any():
        low = np.array(np.unravel_index(int(left.argmax()), left.shape))
        high = low + 1
        for axis in (1, 0, 2):
            _grow(wanted, low, high, axis)
        cells = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        left[cells] = False
        x, y, z = (
            (float(plane[a]), float(plane[b]))
            for plane, a, b in zip(planes, low, high, strict=True)
        )
        boxes.append((x, y, z))
    return tuple(boxes)


def _grow(
    wanted: NDArray[np.bool_], low: NDArray[np.intp], high: NDArray[np.intp], axis: int
) -> None:
    """Move a box's two sides along an axis outwards, as far as cells are wanted."""

    def layer(at: int) -> bool:
        cells = [slice(a, b) for a, b in zip(low, high, strict=True)]
        cells[axis] = slice(at, at + 1)
        return bool(wanted[tuple(cells)].all())

    while low[axis] > 0 and layer(low[axis] - 1):
        low[axis] -= 1
    while high[axis] < wanted.shape[axis] and layer(high[axis]):
        high[axis] += 1


def _nearest_square(
    boxes: tuple[Box, ...], places: tuple[Doubles, Doubles, Doubles]
) -> Doubles:
    nearest = np.full(np.broadcast_shapes(*(p.shape for p in places)), np.inf)
    for box in boxes:
        x, y, z = (
            np.maximum(np.maximum(low - place, place - high), 0.0) ** 2
            for (low, high), place in zip(box, places, strict=True)
        )
        np.minimum(nearest, x + y + z, out=nearest)
    return nearest
