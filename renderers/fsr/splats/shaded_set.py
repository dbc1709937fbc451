"""A fuzzy set lit and classified once, for every view of it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.fuzzy_set import FuzzySet
from renderers.fsr.kernels.shade_splats import paint_splats
from renderers.fsr.splats.grid_view import grid_of
from renderers.scene import Scene

TABLE_ROWS = 4096

SHEET_STEPS = 0.25
"""Thickness of a sheet in grid steps. Opacity does not depend on it; within a sheet
colours mix without order, and bone a step behind opaque mucosa shines through: half a
million splats of a nose are .027 (RMSE) from a ray caster's picture with one step, .020
with a quarter."""


class PaintedSet:
    """Hold what a projection needs of every splat.

    Ambient and diffuse light only: like the 1995 renderer, it varies no highlights
    from splat to splat. Neither depends on the eye.

    rows: where splats are; grid: what their views share. places: ``(n, 4)`` float32,
    grid place (i, j, k) and extinction times volume (mm^2). paints: ``(n, 4)`` float32
    linear RGB, lit, and the size in grid steps. columns: ``(n + 32,)`` uint16, grid
    place i once more.
    row_numbers, row_starts, row_places, whole_rows, bounds: the rows that hold any,
    see `list_strip`.
    widest_mm: the largest spacing. sheet_mm: thickness of a sheet.
    """

    def __init__(self, fuzzy_set: FuzzySet, scene: Scene) -> None:
        low, high = scene.volume.value_range
        high = max(high, low + 1.0)
        lights = np.array(
            [[*li.vector, *li.color, float(li.is_local)] for li in scene.lights],
            dtype=np.float64,
        ).reshape(-1, 7)
        # one to spare: vectors read the first splat where they have none
        room = max(len(fuzzy_set), 1)
        self.rows = fuzzy_set.rows
        self.grid = grid_of(fuzzy_set.rows)
        self.widest_mm = float(scene.volume.spacing_mm.max())
        self.sheet_mm = SHEET_STEPS * float(np.prod(scene.volume.spacing_mm) ** (1 / 3))
        self.places: NDArray[np.float32] = np.zeros((room, 4), np.float32)
        self.paints: NDArray[np.float32] = np.zeros((room, 4), np.float32)
        paint_splats(
            self.rows.offsets,
            self.rows.x,
            self.rows.shape[1],
            fuzzy_set.octahedral,
            fuzzy_set.value,
            self.rows.world_from_voxel,
            float(np.prod(scene.volume.spacing_mm)),
            scene.transfer_function.table(low, high, TABLE_ROWS),
            low,
            (TABLE_ROWS - 1) / (high - low),
            lights,
            scene.material.ambient,
            scene.material.diffuse,
            self.places,
            self.paints,
        )
        # 32 to spare: vectors read beyond the last
        self.columns: NDArray[np.uint16] = np.zeros(len(self.rows) + 32, np.uint16)
        self.columns[: len(self.rows)] = self.rows.x
        self._list_rows()

    @property
    def listed(self) -> tuple[NDArray[Any], ...]:
        """Get the rows as `list_strip` takes them."""
        return (
            self.row_numbers,
            self.row_starts,
            self.row_places,
            self.columns,
            self.whole_rows,
            self.bounds,
        )

    def _list_rows(self) -> None:
        offsets, ny = self.rows.offsets, self.rows.shape[1]
        numbers = np.flatnonzero(np.diff(offsets)).astype(np.int32)
        # where a row ends the next one begins: there is nothing between
        starts = np.append(offsets[numbers], offsets[-1]).astype(np.int32)
        self.row_numbers: NDArray[np.int32] = numbers
        # sixteen to spare: vectors read beyond the last row
        self.row_starts: NDArray[np.int32] = np.pad(starts, (0, 16), mode="edge")
        places = np.zeros((4, len(numbers) + 16), np.uint16)
        places[:, : len(numbers)] = (
            numbers % ny,
            numbers // ny,
            self.columns[starts[:-1]],
            self.columns[starts[1:] - 1],
        )
        self.row_places: NDArray[np.uint16] = places
        self.whole_rows = np.column_stack([numbers, starts[:-1], starts[1:]])
        self.bounds: NDArray[np.float32] = np.zeros((2, 3), np.float32)
        if len(numbers) > 0:
            j, k, first, last = places[:, : len(numbers)]
            self.bounds[0] = first.min(), j.min(), k.min()
            self.bounds[1] = last.max(), j.max(), k.max()
