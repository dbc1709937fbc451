"""A scene made ready for one rank: its march, its cells, its node."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from renderers.art.cells.bricks import Bricks
from renderers.art.cells.cache import CellCache
from renderers.art.cells.cells import CellShare
from renderers.art.cells.memory_budget import require_cache, require_distances
from renderers.art.classification import about_zero
from renderers.art.crew import ALONE, Crew
from renderers.art.march import March
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
from renderers.art.ranks.scene_look import LookSettings, SceneLook
from renderers.art.ranks.work import MarchWork
from renderers.scene import Scene
from renderers.scene.change import changed_box
from renderers.scene.deflection import Deflection
from renderers.scene.memory_limit import memory_limit
from renderers.simd.self_check import require_vectors

Box = tuple[NDArray[np.int64], NDArray[np.int64]]
"""First and last voxel, (i, j, k), as a `Change` has them."""

MarchNode = Node[RayPacket]

LONE = CellPolicy(dataflow=Dataflow.STATIC)
"""Of a rank that is not told how to share cells."""

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
            f"cells each, got {slots}; take more ranks, larger caches or --from-file"
        )
    return slots, slots - min(MOST_WORKING, (slots - share + 1) // 2)


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
    if policy.dataflow in (Dataflow.REPLICATED, Dataflow.SHARED) or ranks == 1:
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
    crew: Crew = ALONE,
) -> tuple[March, MarchNode, MarchWork]:
    """Prepare one rank for a scene in mode `classic` or `scope`.

    policy: without a number of cells a rank keeps all that can be seen and there is
    room for; ValueError where there is room for too few. distances: what separates
    ranks; None where it makes no difference.
    cell_side: None for the quickest that keep a lit copy small. packet: rays that march
    together; None for the fastest way. deflection: deflects the rays. crew: prepares it
    together; all of them call this alike.
    """
    if not 0 <= rank < ranks:
        raise ValueError(f"rank must be 0 to {ranks - 1}, got {rank}")
    require_vectors("The ray tracer")
    limit = memory_limit() if policy.memory_bytes is None else policy.memory_bytes
    if ranks == 1:
        require_distances(scene.volume.shape, limit)
    settings = LookSettings(mode, quality, packet, deflection)
    if mode == "classic":
        scene = about_zero(scene)
    looked = SceneLook.of(scene, settings, cell_side, crew)
    seen, march = looked.seen.copy(), looked.march
    fits_whole = True
    if ranks == 1 and policy.cache_cells is None and not policy.from_file:
        budget = looked.budget(limit)
        policy = replace(policy, cache_cells=budget.cells)
        fits_whole = budget.whole
    shares = policy.dataflow is Dataflow.SHARED and crew.is_shared
    if shares:
        # each cell has its place
        policy = replace(policy, cache_cells=None, from_file=False)
        together = limit * (1 if policy.memory_bytes is None else ranks)
        fits_whole = crew.agree(looked.fits(together, whole=True))
        shares = crew.agree(looked.fits(together))
        if not shares:
            # not even together: each has its part of the memory, and the file the rest
            policy, crew = replace(policy, from_file=True), Crew(crew.run)
    migrates = policy.dataflow is Dataflow.MIGRATING and ranks > 1
    if ranks > 1 and policy.cache_cells is None and not shares:
        near = [far <= 1 for far in distances(rank)] if distances else []
        limit = policy.memory_bytes or memory_limit(max(sum(near), 1))
        policy = replace(policy, cache_cells=looked.budget(limit, raw=migrates).cells)
    elif policy.cache_cells is not None:
        kept = min(policy.cache_cells, int(np.count_nonzero(seen)))
        require_cache(kept, looked.brick_bytes(raw=migrates), limit)
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
        crew=crew,
    )
    if looked.shows_empty:
        empty = np.flatnonzero(~seen)
        crew.once(lambda: bricks.show_empty(empty, looked.empty_value))
    share = CellShare(looked.grid, values, mine, wanted=seen)
    work = MarchWork(looked, bricks, share, keeps_raw=migrates, seen=seen)
    work.use(crew)
    node = Node(
        work,
        Directory(rank, home, owner, distances or ring_distances(ranks)),
        cache,
        migrates=migrates,
        stamps=not is_full,
        most_cells=policy.cache_cells,
        validate=validate,
    )
    return march, node, work


def edit_node(
    node: MarchNode, work: MarchWork, scene: Scene, box: Box | None = None
) -> March | None:
    """Go on with an edited volume of the same grid, on every rank alike.

    scene: the same but for the volume's values. box: first and last voxel that may
    differ, (i, j, k); None to compare the volumes, which an edit in place does not
    allow. Only cells in the box are read and fetched anew. None, and nothing is done,
    where `SceneLook.follow` cannot: make a new node.
    """
    looked, grid, before = work.look, work.bricks.grid, work.share.values
    if looked.settings.mode == "classic":
        scene = about_zero(scene)
    values = looked.settings.volume(scene).values
    if values.shape != grid.shape or values.dtype != before.dtype:
        return None
    if box is None and np.may_share_memory(before, values):
        raise ValueError("a volume edited in place cannot be compared; give the box")
    # where nothing differs a voxel is looked at for all
    box = box or changed_box(before, values) or (np.zeros(3, int), np.zeros(3, int))
    ends = np.stack([box[0][::-1], box[1][::-1]])
    low, high = np.clip(ends, 0, np.array(grid.shape) - 1)
    if not looked.follow(scene, low, high):
        return None
    fresh = np.flatnonzero(looked.seen & ~work.seen)
    changed = np.union1d(grid.touched(low, high), fresh)
    work.follow(values, (low, high), changed, fresh)
    node.admit(fresh.tolist(), work.occupied)
    if not node.migrates:
        work.share.keep(fresh[node.directory.home_of[fresh] == node.rank])
    node.edit(node.generation + 1, changed.tolist())
    work.bricks.use(node.cache.stamp)
    if looked.shows_empty:
        work.bricks.show_empty(np.flatnonzero(~work.seen), looked.empty_value)
    return looked.march
