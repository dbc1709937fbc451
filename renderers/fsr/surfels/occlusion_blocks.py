"""Blocks of the grid, and which of them a view may show.

Behind the wall of a nasal cavity lie sinuses with most of the patient's surface. One
cone per square of pixels is traced through the distance field to where tissue spans
it; a block that lies behind the ends of all its cones is left out, with all that is in
it: there is closed tissue in front of it.
"""

import itertools
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.cones import aim_cones, trace_cones
from renderers.fsr.kernels.occlusion import BlockReach, flag_blocks, list_runs
from renderers.fsr.kernels.view_planes import Lens
from renderers.fsr.sparse_rows import SparseRows
from renderers.fsr.surfels.surfel_set import Surfels
from renderers.fsr.view_bounds import lens_of, lens_planes
from renderers.scene import Camera, Volume
from renderers.scene.thread_team import ThreadTeam

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

SPARE_ROWS = 16
"""Rows after the last: vectors load sixteen at a time."""


@dataclass(frozen=True, slots=True)
class Visible:
    """Say which blocks may show; it holds until the next look.

    shown: per occupied block 0 or the marks `NEAR` and `FAR`. distances: of their
    middles from the eye (mm).
    """

    shown: NDArray[np.uint8]
    distances: NDArray[np.float32]
    in_view: int
    hidden: int


@dataclass(frozen=True, slots=True)
class BlockOrder:
    """Say how a set's elements are sorted by blocks.

    index: ``(n,)`` int64, the elements in the new order. offsets: ``(blocks + 1,)``
    int64, where each block's elements begin in it, and the end. rows: ``(blocks,)``
    int64, how many rows of the grid each block's elements are in.
    """

    index: NDArray[np.int64]
    offsets: NDArray[np.int64]
    rows: NDArray[np.int64]


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
    """Hold the blocks with surfels of one distance field."""

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
        self._values = distance.values.astype(np.float32, copy=False)
        self._values.flags.writeable = False
        nz, ny, nx = distance.shape
        self._deep, self._high, self._wide = (
            (n - 1 >> BLOCK_SHIFT) + 1 for n in (nz, ny, nx)
        )
        occupied = np.zeros((self._deep, self._high, self._wide), bool)
        for rows, shift in ((coarse, BLOCK_SHIFT), (fine, BLOCK_SHIFT + 1)):
            i, j, k = (rows.voxels() >> shift).T
            occupied[k, j, i] = True
        self._occupied = np.flatnonzero(occupied).astype(np.int32)
        edge = 1 << BLOCK_SHIFT
        self._middles = np.ascontiguousarray(edge * self.places.T + 0.5 * (edge - 1))
        bounds = [*range(0, len(self._occupied), BLOCKS_PER_PART), len(self._occupied)]
        self._parts = list(itertools.pairwise(bounds))
        self._shown = np.zeros(len(self._occupied), np.uint8)
        self._all = np.ones(len(self._occupied), np.uint8)
        self._distances = np.zeros(len(self._occupied), np.float32)
        self._heads = np.zeros(DISTANCE_STEPS + 1, np.int64)

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
        return BlockOrder(index, offsets, np.diff(begun[offsets]))

    def runs(self, visible: Visible, mark: int, order: BlockOrder, part: int) -> Runs:
        """List a sorted set's elements in the visible blocks with a mark.

        part: elements after which a new part begins.
        """
        runs = np.empty((len(self._occupied), 2), np.int64)
        cuts = np.empty((int(order.offsets[-1]) // part + 2, 2), np.int64)
        total, parts, rows = list_runs(
            visible.shown,
            mark,
            visible.distances,
            DISTANCE_STEP_MM,
            order.offsets,
            part,
            order.rows,
            self._heads,
            runs,
            cuts,
        )
        return Runs(runs[:total], cuts[: parts + 1], int(rows))

    def visible(
        self,
        camera: Camera,
        team: ThreadTeam,
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

        def trace(first: int) -> None:
            trace_cones(
                self._values,
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
            team.map(trace, range(0, shape[0], ROWS_PER_TASK))
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

        counts = team.map(flag, self._parts)
        in_view = sum(met for met, _ in counts)
        hidden = sum(count for _, count in counts)
        return Visible(self._shown, self._distances, in_view, hidden)


@dataclass(frozen=True, slots=True)
class BlockedSurfels:
    """Hold surfels block by block, in grid order within a block.

    position, normal: ``(n + 16, 3)`` float32 as in `Surfels`. order: where each block
    begins. first_mm: world position of the grid's first point, from which positions
    are counted. spacing_mm: as in `Surfels`.
    """

    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    order: BlockOrder
    first_mm: NDArray[np.float64]
    spacing_mm: float

    def __len__(self) -> int:
        return len(self.order.index)


def sort_surfels(surfels: Surfels, blocks: Blocks, shift: int) -> BlockedSurfels:
    """Sort; a block has ``2**shift`` of the surfels' voxels a side."""
    order = blocks.sort(surfels.rows, shift)
    position, normal = (
        np.concatenate([array[order.index], np.ones((SPARE_ROWS, 3), np.float32)])
        for array in (surfels.position, surfels.normal)
    )
    first_mm = surfels.rows.world_from_voxel[:3, 3]
    return BlockedSurfels(position, normal, order, first_mm, surfels.spacing_mm)


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
