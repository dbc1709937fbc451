"""A scene made ready for one rank: its march, its cells, its node."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderers.art.cells.bricks import MOST_VOXELS, Bricks
from renderers.art.cells.cache import CellCache
from renderers.art.cells.cell_size import QUICK_SIDE, side_for
from renderers.art.cells.cells import CellGrid, CellShare, cube_distances
from renderers.art.cells.memory_budget import MemoryBudget, budget_for, demand_distances
from renderers.art.kernels.build_bricks import SHORT
from renderers.art.march import ClassicMarch, March, ScopeMarch
from renderers.art.quality import Quality
from renderers.art.ranks.directory import (
    EMPTY,
    ON_DISK,
    Directory,
    Distances,
    deal_owners,
    homes,
    ring_distances,
)
from renderers.art.ranks.node import Node
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.rays import RayPacket
from renderers.art.ranks.work import MarchWork
from renderers.art.step_estimation import with_estimated_step
from renderers.lanes.self_check import demand_vectors
from renderers.scene import Scene
from renderers.scene.deflection import Deflection
from renderers.scene.memory_limit import memory_limit

MarchNode = Node[RayPacket]

LONE = CellPolicy(dataflow=Dataflow.STATIC)
"""Of a rank that is not told how to share cells."""

LARGEST_LEAP = 1 << 28
"""Voxels of the largest volume for which each cube's distance is kept, one byte each.
Beyond it rays step through empty cells, all of which are the same brick."""

MOST_WORKING = 64
"""Slots of a cache that owned cells leave free, at most: twice the requests in flight.
Of less room than that, half is left free and half is for cells whose owner gives up."""


def slots_of(cells: int, ranks: int, wanted: int | None) -> tuple[int, int]:
    """Return a rank's slots, and how many may be owned cells where cells migrate.

    wanted: slots; None for as many as there are cells. Raise ValueError when all ranks
    together could not hold every cell and still work.
    """
    share = -(-cells // ranks)
    slots = max(cells, share + 1) if wanted is None else wanted
    if slots < share + 1:
        raise ValueError(
            f"{cells} cells over {ranks} ranks need caches of at least {share + 1} "
            f"cells each, got {slots}; take more ranks or larger caches"
        )
    return slots, slots - min(MOST_WORKING, (slots - share + 1) // 2)


@dataclass(frozen=True, slots=True)
class _Look:
    """Hold what a volume's values say: the march and which cells it meets.

    span: as `Bricks` takes it. empty_value: one that cannot be seen, if any cell is
    empty.
    """

    march: March
    grid: CellGrid
    seen: NDArray[np.bool_]
    leap: NDArray[np.uint8]
    span: float | None
    empty_value: float

    @classmethod
    def at(
        cls,
        scene: Scene,
        mode: str,
        quality: Quality,
        cell_side: int,
        packet: int | None,
        deflection: Deflection | None = None,
    ) -> "_Look":
        surface = scene.surface
        if mode == "scope" and surface is None:
            raise ValueError("the scene has no air surface; mode scope needs one")
        volume = (
            scene.volume if surface is None or mode == "classic" else surface.distance
        )
        grid = CellGrid(volume.shape, cell_side)
        ranges = grid.value_ranges(volume.values)
        low, high = float(ranges[:, 0].min()), float(ranges[:, 1].max())
        whole = volume.values.dtype.kind in "iu" and max(-low, high) <= SHORT
        if mode not in ("classic", "scope"):
            raise ValueError(f"mode must be classic or scope, got {mode!r}")
        march: March
        if mode == "classic":
            march = ClassicMarch(scene, quality, (low, high), packet, deflection)
        else:
            march = ScopeMarch(scene, quality, packet, deflection)
        clear = march.clear if quality.skip_empty else np.zeros((0, 2), np.float32)
        is_large = volume.values.size > LARGEST_LEAP
        # see `ClassicMarch`; and all empty cells of a large volume are one brick
        if march.margin > 1 or (march.margin and is_large):
            clear = grid.clearest(ranges, clear)
        seen = grid.occupied(ranges, clear)
        distances = clear[:0] if is_large else clear
        leap = cube_distances(volume.values, distances)
        if march.margin and len(distances):
            cubes = leap[:-3].reshape([n - 1 for n in volume.shape])
            seen = grid.with_cubes(cubes <= march.margin)
        elif march.margin:
            seen = grid.beside(seen)
        span = high - low if whole and quality.compact else None
        empty = ranges[~seen, 0]
        return cls(march, grid, seen, leap, span, float(empty[0]) if len(empty) else 0)

    def budget(self, limit: int) -> MemoryBudget:
        """Fit what one rank draws with into so many bytes; ValueError if it cannot."""
        march, voxels = self.march, math.prod(self.grid.shape)
        number = 4 if self.span is None else 2
        channels = 4 if march.needs_gradients else 1
        wanted = march.seeks_values and voxels < MOST_VOXELS
        return budget_for(
            self.grid.shape,
            int(np.count_nonzero(self.seen)),
            (self.grid.side + 1) ** 3 * channels * number,
            voxels * number if wanted else 0,
            limit,
            bricks=march.needs_gradients,
        )


def _look(
    scene: Scene,
    mode: str,
    quality: Quality,
    cell_side: int | None,
    packet: int | None,
    deflection: Deflection | None,
) -> _Look:
    """Look at a volume by cells of a side; None for the quickest that keep it small."""
    side = QUICK_SIDE if cell_side is None else cell_side
    looked = _Look.at(scene, mode, quality, side, packet, deflection)
    if cell_side is None and looked.march.needs_gradients:
        side = side_for(looked.grid.shape, int(np.count_nonzero(looked.seen)))
        if side != looked.grid.side:
            looked = _Look.at(scene, mode, quality, side, packet, deflection)
    return looked


def _share_out(
    seen: NDArray[np.bool_], rank: int, ranks: int, policy: CellPolicy, migrates: bool
) -> tuple[CellCache, NDArray[np.int64], NDArray[np.int64], NDArray[np.int64] | None]:
    """Return a rank's cache, all cells' homes and owners, and the cells it keeps.

    The last is None where the rank reads any cell itself.
    """
    full = int(np.count_nonzero(seen))
    home = homes(len(seen), ranks)
    owner = deal_owners(seen, ranks) if migrates else home
    if migrates and policy.from_file:
        owner = np.where(seen, ON_DISK, EMPTY)
    if policy.dataflow is Dataflow.RAYS:
        # Neighbouring cells belong together: a ray then stays longer where it is.
        home = deal_owners(seen, ranks)
    mine: NDArray[np.int64] | None
    if migrates and not policy.from_file:
        cache = CellCache(*slots_of(full, ranks, policy.cache_cells))
        mine = np.flatnonzero(owner == rank)
        for cell in mine.tolist():
            cache.own(cell)
        return cache, home, owner, mine
    if policy.cache_cells is not None and policy.cache_cells < 1:
        raise ValueError(f"a cache needs at least 1 cell, got {policy.cache_cells}")
    cache = CellCache(max(min(policy.cache_cells or full, full), 1))
    mine = np.flatnonzero(seen & (home == rank))
    if policy.dataflow is Dataflow.REPLICATED or ranks == 1:
        home, mine = np.full(len(seen), rank), None
    if policy.from_file:
        mine = np.zeros(0, np.int64) if migrates else None
    return cache, home, owner, mine


def make_node(
    scene: Scene,
    mode: str,
    quality: Quality,
    *,
    rank: int = 0,
    ranks: int = 1,
    policy: CellPolicy = LONE,
    distances: Distances | None = None,
    cell_side: int | None = 8,
    validate: bool = False,
    packet: int | None = None,
    deflection: Deflection | None = None,
    memory_bytes: int | None = None,
) -> tuple[March, MarchNode, MarchWork]:
    """Prepare one rank for a scene in mode `classic` or `scope`.

    policy: without a number of cells a lone rank keeps all that can be seen and there
    is room for. distances: what separates ranks; None where it makes no difference.
    cell_side: None for the quickest that keep a lit copy small. packet: rays that march
    together; None for the fastest way. deflection: deflects the rays. memory_bytes:
    that one rank alone may take beside the volume; None for half of the machine's.
    Raise ValueError where that is too little.
    """
    if not 0 <= rank < ranks:
        raise ValueError(f"rank must be 0 to {ranks - 1}, got {rank}")
    demand_vectors("The ray tracer")
    limit = memory_limit() if memory_bytes is None else memory_bytes
    if ranks == 1:
        demand_distances(scene.volume.shape, limit)
    if mode == "classic":
        quality = with_estimated_step(scene, quality)
    looked = _look(scene, mode, quality, cell_side, packet, deflection)
    seen, march = looked.seen, looked.march
    fits_whole = True
    if ranks == 1 and policy.cache_cells is None and not policy.from_file:
        budget = looked.budget(limit)
        policy = replace(policy, cache_cells=budget.cells)
        fits_whole = budget.whole
    migrates = policy.dataflow is Dataflow.MIGRATING and ranks > 1
    cache, home, owner, mine = _share_out(seen, rank, ranks, policy, migrates)
    is_full = cache.capacity >= int(np.count_nonzero(seen))
    values = march.volume.values
    lone = mine is None and not policy.from_file and is_full
    bricks = Bricks(
        looked.grid,
        march.volume.spacing_mm,
        looked.leap,
        cache.stamp,
        looked.span,
        gradients=march.needs_gradients,
        whole=values if lone and fits_whole and march.seeks_values else None,
    )
    if not looked.leap.any() and not seen.all():
        bricks.show_empty(np.flatnonzero(~seen), looked.empty_value)
    share = CellShare(looked.grid, values, mine, wanted=seen)
    work = MarchWork(march, bricks, share, keeps_raw=migrates, seen=seen)
    node = Node(
        work,
        Directory(rank, home, owner, distances or ring_distances(ranks)),
        cache,
        migrates=migrates,
        stamps=not is_full,
        validate=validate,
    )
    return march, node, work


def edit_node(
    node: MarchNode,
    work: MarchWork,
    scene: Scene,
    mode: str,
    quality: Quality,
    deflection: Deflection | None = None,
) -> March | None:
    """Go on with an edited volume of the same grid, on every rank alike.

    Only cells that changed are read and fetched anew. None, and nothing is done, when
    a cell can be seen now that was empty before, and so has no owner, or the range of
    values, which compact bricks go by, is another: make a new node. Tissue that is
    removed does neither, unless it was the densest.
    """
    grid, before = work.bricks.grid, work.share.values
    if mode == "classic":
        quality = with_estimated_step(scene, quality)
    looked = _Look.at(scene, mode, quality, grid.side, None, deflection)
    values = looked.march.volume.values
    if looked.grid != grid or values.dtype != before.dtype:
        return None
    if looked.span != work.bricks.span or bool(np.any(looked.seen & ~work.seen)):
        return None
    changed = grid.touched(before != values)
    work.replace(looked.march, looked.leap, values)
    node.edit(node.generation + 1, changed)
    return looked.march
