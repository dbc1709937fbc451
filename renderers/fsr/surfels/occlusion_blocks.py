"""Blocks of the grid, and which of them a view may show.

Behind the wall of a nasal cavity lie sinuses with most of the patient's surface. One
cone per square of pixels is traced through the distance field to where tissue spans
it; a block that lies behind the ends of all its cones is left out, with all that is in
it: there is closed tissue in front of it.
"""

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.cones import aim_cones, trace_cones
from renderers.fsr.kernels.extract_surfels import MARGIN, mark_blocks
from renderers.fsr.kernels.occlusion import BlockReach, flag_blocks, list_runs
from renderers.fsr.kernels.view_planes import Lens
from renderers.fsr.sparse_rows import SparseRows
from renderers.fsr.surfels.surfel_pool import BlockSpans, SurfelPool
from renderers.fsr.surfels.surfel_set import Surfels
from renderers.fsr.view_bounds import lens_of, lens_planes
from renderers.scene import Camera, Change, Volume
from renderers.scene.thread_pool import ThreadPool

BLOCK_SHIFT = 2
"""Blocks of 4 voxels a side: with 8, a ball around one spans too many cones."""

SQUARE_PX = 16
"""Pixels a side of one cone's square."""

MARGIN_VOXELS = 0.25
"""Tissue that a cone must meet beyond its radius: trilinear distances are this good."""

DISTANCE_STEP_MM = 0.5
DISTANCE_STEPS = 512
"""Blocks are sorted by their distance in these steps; beyond the last, not at all."""

ROWS_PER_TASK = 4
BLOCKS_PER_PART = 2048

NEAR, FAR = 2, 1


@dataclass(frozen=True, slots=True)
class Visible:
    """Which blocks may show; it holds until the next look.

    shown: per occupied block 0 or the marks `NEAR` and `FAR`. distances: of their
    middles from the eye (mm).
    """

    shown: NDArray[np.uint8]
    distances: NDArray[np.float32]
    in_view: int
    hidden: int


@dataclass(frozen=True, slots=True)
class BlockOrder:
    """How a set's elements are sorted by blocks.

    index: ``(n,)`` int64, the elements in the new order. spans: where each block's
    elements are in it.
    """

    index: NDArray[np.int64]
    spans: BlockSpans


@dataclass(frozen=True, slots=True)
class Runs:
    """List elements of a set that is sorted by blocks, near blocks first.

    runs: ``(r, 2)`` int64, first elements and ends. cuts: ``(p + 1, 2)`` int64, where
    parts of about equal work begin: in runs, and in elements. rows: of the elements'
    grid, a row counted in every block that it passes.
    """

    runs: NDArray[np.int64]
    cuts: NDArray[np.int64]
    rows: int

    def __len__(self) -> int:
        return int(self.cuts[-1, 1])


class Blocks:
    """The blocks with surfels of one distance field."""

    def __init__(
        self,
        distance: Volume,
        coarse: SparseRows,
        fine: SparseRows,
    ) -> None:
        self._distance = distance
        self._margin = np.float32(MARGIN_VOXELS * distance.spacing_mm.max())
        block_mm = distance.spacing_mm * (1 << BLOCK_SHIFT)
        self._half_diagonal = float(np.linalg.norm(block_mm)) / 2
        nz, ny, nx = distance.shape
        self._deep, self._high, self._wide = (
            (n - 1 >> BLOCK_SHIFT) + 1 for n in (nz, ny, nx)
        )
        occupied = np.zeros((self._deep, self._high, self._wide), bool)
        for rows, shift in ((coarse, BLOCK_SHIFT), (fine, BLOCK_SHIFT + 1)):
            i, j, k = (rows.voxels() >> shift).T
            occupied[k, j, i] = True
        self._list(np.flatnonzero(occupied).astype(np.int32))
        self._heads = np.zeros(DISTANCE_STEPS + 1, np.int64)

    def _list(self, occupied: NDArray[np.int32]) -> None:
        """Take other blocks; they are listed by their numbers."""
        count = len(occupied)
        self._occupied = occupied
        edge = 1 << BLOCK_SHIFT
        self._middles = np.ascontiguousarray(edge * self.places.T + 0.5 * (edge - 1))
        self._parts = list(
            itertools.pairwise([*range(0, count, BLOCKS_PER_PART), count])
        )
        self._shown = np.zeros(count, np.uint8)
        self._all = np.ones(count, np.uint8)
        self._distances = np.zeros(count, np.float32)

    @property
    def numbers(self) -> NDArray[np.int32]:
        """Return the places of the blocks on their grid, ``(k * ny + j) * nx + i``."""
        return self._occupied

    @property
    def places(self) -> NDArray[np.int64]:
        """Return the blocks' grid coordinates ``(b, 3)``, (i, j, k)."""
        grid = self._deep, self._high, self._wide
        return np.stack(np.unravel_index(self._occupied, grid)[::-1], axis=-1)

    def sort(self, rows: SparseRows, shift: int) -> BlockOrder:
        """Return the order that brings a set's elements block by block.

        shift: a block has ``2**shift`` of the set's voxels a side.
        """
        voxels = rows.voxels()
        i, j, k = (voxels >> shift).T
        block = (k * self._high + j) * self._wide + i
        index = np.argsort(block, kind="stable")
        block = block[index]
        ends = np.searchsorted(block, self._occupied, side="right")
        offsets = np.concatenate([[0], ends]).astype(np.int64)
        # within a block elements keep the grid's order, row after row
        _, y, z = voxels[index].T
        begins = np.ones(len(index), bool)
        begins[1:] = np.diff(block) | np.diff(y) | np.diff(z)
        begun = np.concatenate([[0], np.cumsum(begins)])
        spans = BlockSpans(offsets[:-1], offsets[1:].copy(), np.diff(begun[offsets]))
        return BlockOrder(index, spans)

    def around(
        self, change: Change, before: NDArray[np.float32] | None
    ) -> NDArray[np.int64]:
        """Return the places (i, j, k) of blocks that depend on what changed.

        ``(b, 3)``, increasing as the blocks' numbers do. before: values before the
        change, which become those after it; None where they are not known.
        """
        top = np.array([self._wide, self._high, self._deep]) - 1
        margin = math.ceil(MARGIN)
        first = np.clip(change.low - margin >> BLOCK_SHIFT, 0, top)
        last = np.clip(change.high + margin >> BLOCK_SHIFT, 0, top)
        marks = np.full((last - first + 1)[::-1], before is None, np.uint8)
        if before is not None:
            values = self._distance.values
            low = np.maximum(change.low, 0)
            high = np.minimum(change.high, np.array(values.shape[::-1]) - 1)
            mark_blocks(values, before, low, high, 1 << BLOCK_SHIFT, first, marks)
        places: NDArray[np.int64] = np.argwhere(marks)[:, ::-1] + first
        return places

    def number(self, places: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the numbers of blocks at places (i, j, k) on their grid."""
        i, j, k = places.T
        numbers: NDArray[np.int64] = (k * self._high + j) * self._wide + i
        return numbers

    def occupy(
        self, numbers: NDArray[np.int64], full: NDArray[np.bool_]
    ) -> NDArray[np.int64] | None:
        """List those of some blocks that are full, and the others no more.

        numbers: increasing. Returns where each of the blocks listed now was before, or
        -1; None where they are the same as before.
        """
        before = self._occupied
        at = np.searchsorted(before, numbers)
        known = (
            before[np.minimum(at, len(before) - 1)] == numbers
            if len(before)
            else (np.zeros(len(numbers), np.bool_))
        )
        if np.array_equal(known, full):
            return None
        source = np.delete(np.arange(len(before)), at[known & ~full])
        after = before[source]
        fresh = numbers[full & ~known]
        to = np.searchsorted(after, fresh)
        self._list(np.insert(after, to, fresh).astype(np.int32))
        return np.insert(source, to, -1)

    def runs(self, visible: Visible, mark: int, spans: BlockSpans, part: int) -> Runs:
        """List a sorted set's elements in the visible blocks with a mark.

        part: elements after which a new part begins.
        """
        runs = np.empty((len(self._occupied), 2), np.int64)
        cuts = np.empty((spans.total // part + 2, 2), np.int64)
        total, parts, rows = list_runs(
            visible.shown,
            mark,
            visible.distances,
            DISTANCE_STEP_MM,
            *spans,
            part,
            self._heads,
            runs,
            cuts,
        )
        return Runs(runs[:total], cuts[: parts + 1], int(rows))

    def visible(
        self,
        camera: Camera,
        pool: ThreadPool,
        *,
        radius_mm: float,
        near_reach_mm: float,
        far_from_mm: float,
        hide: bool = True,
        allowed: NDArray[np.uint8] | None = None,
    ) -> Visible:
        """Mark blocks that reach into the view and are not hidden.

        radius_mm: of an element with its disc. near_reach_mm, far_from_mm: fine
        elements are wanted up to, coarse ones from this distance. hide: without,
        no cones are traced. allowed: per block, 0 for those known to be hidden.
        """
        camera_from_voxel = _camera_from_voxel(camera, self._distance)
        lens = lens_of(camera)
        reach = BlockReach(self._half_diagonal + radius_mm, near_reach_mm, far_from_mm)
        shape = (-(-camera.height // SQUARE_PX), -(-camera.width // SQUARE_PX))
        ends = np.full(shape if hide else (0, 0), np.inf, np.float32)
        # of an air surface no copy: who edits it edits what is traced here
        values = self._distance.values.astype(np.float32, copy=False)

        def trace(first: int) -> None:
            trace_cones(
                values,
                voxel_from_camera,
                cones,
                self._margin,
                first,
                min(first + ROWS_PER_TASK, shape[0]),
                ends,
            )

        if hide:
            cones = _lens_cones(lens)
            inverse = np.linalg.inv(camera_from_voxel)
            voxel_from_camera = np.ascontiguousarray(inverse[:3], np.float32)
            pool.map(trace, range(0, shape[0], ROWS_PER_TASK))
        planes = lens_planes(
            camera.projection, camera.extent, camera.width, camera.height
        )

        def flag(part: tuple[int, int]) -> tuple[int, int]:
            met, hidden = flag_blocks(
                self._middles,
                part[0],
                part[1],
                camera_from_voxel,
                planes,
                reach,
                lens,
                SQUARE_PX,
                ends,
                self._all if allowed is None else allowed,
                self._shown,
                self._distances,
            )
            return met, hidden

        counts = pool.map(flag, self._parts)
        in_view = sum(met for met, _ in counts)
        hidden = sum(count for _, count in counts)
        return Visible(self._shown, self._distances, in_view, hidden)


def pool_surfels(surfels: Surfels, blocks: Blocks, shift: int) -> SurfelPool:
    """Sort; a block has ``2**shift`` of the surfels' voxels a side."""
    order = blocks.sort(surfels.rows, shift)
    refine = 1 << shift - BLOCK_SHIFT
    return SurfelPool(surfels, order.index, order.spans, shift, refine)


def _camera_from_voxel(camera: Camera, distance: Volume) -> NDArray[np.float64]:
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3] = camera.frame[1:]
    camera_from_world[:3, 3] = -camera.frame[1:] @ camera.eye_mm
    camera_from_voxel: NDArray[np.float64] = (
        camera_from_world @ distance.world_from_voxel
    )
    return camera_from_voxel


@lru_cache(maxsize=4)
def _lens_cones(lens: Lens) -> NDArray[np.float32]:
    """Return a lens's cones ``(5, rows, columns)``; see `aim_cones`."""
    shape = (5, -(-lens.height // SQUARE_PX), -(-lens.width // SQUARE_PX))
    cones = np.empty(shape, np.float32)
    aim_cones(lens, SQUARE_PX, cones)
    return cones
