"""A fuzzy set lit and classified once, for every view of it."""

import itertools

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.fuzzy_set import FuzzySet
from renderers.fsr.kernels.clip_rows import Rows
from renderers.fsr.kernels.footprint import DEEPEST, PEAK
from renderers.fsr.kernels.project_splats import Splats
from renderers.fsr.kernels.shade_splats import ColorTable, shade_splats
from renderers.fsr.kernels.view_planes import Grid
from renderers.fsr.sparse_rows import SparseRows
from renderers.scene import Scene

TABLE_ROWS = 4096

_CORNERS = np.array(list(itertools.product((0.0, 1.0), repeat=3))).T
_PEAK = np.polynomial.Polynomial([0.0, *PEAK])


def splat_peaks(depth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how opaque the centres of splats are that stand for optical depths."""
    peaks = _PEAK(np.minimum(depth, float(DEEPEST)))
    return np.clip(np.asarray(peaks, dtype=np.float64), 0.0, 1.0)


class ShadedSet:
    """What a projection needs of every splat.

    Ambient and diffuse light only: like the 1995 renderer, it varies no highlights
    from splat to splat. Neither depends on the eye.

    sparse: where splats are. grid: what their views share. splats, rows: as kernels
    take them. widest_mm: the largest spacing.
    """

    def __init__(self, fuzzy_set: FuzzySet, scene: Scene) -> None:
        low, high = scene.volume.value_range
        high = max(high, low + 1.0)
        lights = np.array(
            [[*li.vector, *li.color, float(li.is_local)] for li in scene.lights],
            dtype=np.float64,
        ).reshape(-1, 7)
        # one to spare: vectors read the first splat where they have none
        size = max(len(fuzzy_set), 1)
        self.sparse = fuzzy_set.rows
        self.grid = grid_of(fuzzy_set.rows)
        self.widest_mm = float(scene.volume.spacing_mm.max())
        self._volume_mm3 = float(np.prod(scene.volume.spacing_mm))
        self.splats = Splats(
            np.zeros((size, 4), np.float32), np.zeros((size, 4), np.float32)
        )
        table = scene.transfer_function.table(low, high, TABLE_ROWS)
        shade_splats(
            self.sparse.offsets,
            self.sparse.x,
            self.sparse.shape[1],
            fuzzy_set.octahedral,
            fuzzy_set.value,
            self.sparse.world_from_voxel,
            self._volume_mm3,
            ColorTable(table, low, (TABLE_ROWS - 1) / (high - low)),
            lights,
            scene.material.ambient,
            scene.material.diffuse,
            self.splats,
        )
        self.rows = _rows_of(fuzzy_set.rows)

    def __len__(self) -> int:
        return len(self.sparse)

    def straight_rgba(self) -> NDArray[np.float64]:
        """Return linear RGB, lit, and peak ``(n, 4)``, for who blends splats elsewhere.

        A peak is what gives a sheet of such splats one voxel's opacity.
        """
        kappa = self.splats.places[: len(self), 3].astype(np.float64) / self._volume_mm3
        peaks = splat_peaks(kappa * self._volume_mm3 ** (1 / 3))
        return np.column_stack([self.splats.colors[: len(self), :3], peaks])


def grid_of(rows: SparseRows) -> Grid:
    """Return what every view of a set needs of its grid."""
    matrix = rows.world_from_voxel
    top = np.array(rows.shape[::-1]) - 1.0
    corners = _CORNERS * (top[:, None] + 1) - 0.5
    corners_mm = matrix[:3, :3] @ corners + matrix[:3, 3:]
    middle_mm = corners_mm.mean(axis=1)
    radius_mm = float(np.linalg.norm(corners_mm.T - middle_mm, axis=1).max())
    inverse = np.asarray(np.linalg.inv(matrix)[:3], np.float64)
    return Grid(matrix[:3, :3], inverse, top, corners_mm, middle_mm, radius_mm)


def _rows_of(rows: SparseRows) -> Rows:
    offsets, ny = rows.offsets, rows.shape[1]
    # 32 to spare: vectors read beyond the last
    columns: NDArray[np.uint16] = np.zeros(len(rows) + 32, np.uint16)
    columns[: len(rows)] = rows.x
    numbers = np.flatnonzero(np.diff(offsets)).astype(np.int32)
    # where a row ends the next one begins: there is nothing between
    starts = np.append(offsets[numbers], offsets[-1]).astype(np.int32)
    places = np.zeros((4, len(numbers) + 16), np.uint16)
    places[:, : len(numbers)] = (
        numbers % ny,
        numbers // ny,
        columns[starts[:-1]],
        columns[starts[1:] - 1],
    )
    bounds: NDArray[np.float32] = np.zeros((2, 3), np.float32)
    if len(numbers) > 0:
        j, k, first, last = places[:, : len(numbers)]
        bounds[0] = first.min(), j.min(), k.min()
        bounds[1] = last.max(), j.max(), k.max()
    return Rows(
        numbers,
        # sixteen to spare: vectors read beyond the last row
        np.pad(starts, (0, 16), mode="edge"),
        places,
        columns,
        np.column_stack([numbers, starts[:-1], starts[1:]]),
        bounds,
        ny,
    )
