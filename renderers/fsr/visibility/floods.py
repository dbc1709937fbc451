"""What can be seen from a box of cells: floods along all three axes, joined."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.visibility_floods import (
    WORD,
    air_rows,
    flood_beams,
    turn_rows,
)
from renderers.scene import Volume

LEAST_BEAMS = 8
"""Ranges of slopes either way. Twice as many take three times as long and reach four
per cent fewer cells (phantom at 0.5 mm)."""

_LAYOUTS = ((0, 1, 2), (1, 0, 2), (2, 0, 1))
"""Axes of a volume in the order in which floods along z, y and x want them."""


@dataclass(frozen=True, slots=True)
class AirCells:
    """A bit for every cell of a grid that may hold air, in three layouts.

    shape: number of cells ``(nz, ny, nx)``. rows: words of bits, the last axis of each
    layout along the word.
    """

    shape: tuple[int, int, int]
    rows: tuple[NDArray[np.uint64], NDArray[np.uint64], NDArray[np.uint64]]


def find_air(distance: Volume) -> AirCells:
    """Find the cells with air, of a signed distance negative in air."""
    nz, ny, nx = distance.shape
    values = distance.values.astype(np.float32, copy=False)
    x, y, z = (_rows_of(values.transpose(layout)) for layout in _LAYOUTS)
    return AirCells((nz - 1, ny - 1, nx - 1), (x, y, z))


def _rows_of(values: NDArray[np.float32]) -> NDArray[np.uint64]:
    layers, across, along = values.shape
    rows = np.zeros((layers - 1, across - 1, -(-(along - 1) // WORD)), np.uint64)
    air_rows(np.ascontiguousarray(values), rows)
    return rows


class BoxFlood:
    """Flood from boxes of cells to what is in sight; keeps memory, so one per thread.

    beams: ranges of slopes, at least `LEAST_BEAMS` and as many as the grid's size
        asks for: a beam may not be wider than a word.
    """

    def __init__(self, air: AirCells, edge: int) -> None:
        self._air = air
        self._edge = edge
        longest = max(air.shape)
        # at the far end a beam is edge + 2 * longest / beams + 3 cells wide
        spare = WORD - edge - 4
        if spare < 8:
            raise ValueError(f"boxes may have up to {WORD - 12} cells, got {edge}")
        needed = -(-2 * longest // spare)
        self.beams = max(LEAST_BEAMS, needed + needed % 2)
        self._seen = tuple(np.zeros_like(rows) for rows in air.rows)
        self._scratch = np.empty((2, longest + 1), np.uint64)

    def seen(self, low: NDArray[np.int64]) -> NDArray[np.uint64]:
        """Return a bit for every cell in sight from a box of `edge` cells a side.

        low: its first cell (i, j, k); it is cut at the grid's end. Returned are rows
        ``(nz, ny, words)`` along x, which hold until the next call.
        """
        top = np.array(self._air.shape) - 1
        first = np.asarray(low, np.int64)[::-1]
        last = np.minimum(first + self._edge - 1, top)
        for layout, air, seen in zip(_LAYOUTS, self._air.rows, self._seen, strict=True):
            seen[:] = 0
            order = list(layout)
            flood_beams(
                air,
                self._air.shape[layout[2]],
                np.ascontiguousarray(first[order]),
                np.ascontiguousarray(last[order]),
                self.beams,
                seen,
                self._scratch[0],
                self._scratch[1],
            )
        along_z, along_y, along_x = self._seen
        along_z |= along_y.transpose(1, 0, 2)
        turn_rows(along_x, along_z)
        return along_z
