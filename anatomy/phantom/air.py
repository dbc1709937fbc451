"""The air of one head, at points or over a lattice."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.frame import lps_from_ras
from anatomy.kernels import evaluate_blocks as kernels
from anatomy.kernels import fill_bricks as filling
from anatomy.kernels.displace import displace
from anatomy.kernels.tables import POINT_ROWS, Floats, Grids, Sampling, Scratch
from anatomy.phantom.coverage import blur_mm
from anatomy.phantom.lattice import Lattice
from anatomy.phantom.model import BAND_MM, Model
from anatomy.phantom.program import Row
from system import UserError, usable_cores

BRICK_VOXELS = 8
_CHUNK = 2048


@dataclass(frozen=True, slots=True)
class Effort:
    """Count what evaluating a lattice took."""

    bricks: int
    bricks_in_reach: int
    part_evaluations: int
    parts_seen: int


def default_threads() -> int:
    """Return the number of processors this process may use."""
    return usable_cores()


def run_in_ranges(
    work: Callable[[int, int], None],
    total: int,
    threads: int,
    pieces: int,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Call `work` on ranges that tile ``[0, total)``; report the finished share."""
    bounds = np.linspace(0, total, min(pieces, total) + 1).astype(int)
    lock = threading.Lock()
    done = 0

    def one(i: int) -> None:
        nonlocal done
        work(int(bounds[i]), int(bounds[i + 1]))
        if progress is not None:
            with lock:
                done += int(bounds[i + 1] - bounds[i])
                progress(done / total)

    with ThreadPoolExecutor(max_workers=threads) as pool:
        for future in [pool.submit(one, i) for i in range(len(bounds) - 1)]:
            future.result()


def empty_grids(shape: tuple[int, ...]) -> Grids:
    """Allocate the outputs of the kernels for a lattice or for one block."""
    return Grids(
        air=np.empty(shape, dtype=np.float32),
        gap=np.empty(shape, dtype=np.float32),
        part=np.empty(shape, dtype=np.uint8),
        structure=np.empty(shape, dtype=np.uint8),
        blood=np.empty(shape, dtype=np.uint8),
        skin=np.empty(shape, dtype=np.uint8),
        ground_hu=np.empty(shape, dtype=np.int16),
        ground=np.empty(shape, dtype=np.uint8),
        plate=np.empty(shape, dtype=np.uint8),
        density=np.empty(shape, dtype=np.uint8),
    )


def evaluate_lattice(
    model: Model,
    lattice: Lattice,
    threads: int = 1,
    brick_voxels: int = BRICK_VOXELS,
    skipping: bool = True,
    progress: Callable[[float], None] | None = None,
) -> tuple[Grids, Effort]:
    """Evaluate air, walls, tint and background at every voxel.

    The result has the same bits for any number of threads, brick size, skipping or
    field of view.
    """
    shape, edge = lattice.shape, brick_voxels
    scale = model.parameters.head_scale
    grids = empty_grids(shape)
    groups = int(np.prod([-(-n // (filling.GROUP * edge)) for n in shape]))
    totals = np.zeros(4, dtype=np.int64)
    lock = threading.Lock()

    def fill(first: int, last: int) -> None:
        points = edge**3
        counters = np.zeros(4, dtype=np.int64)
        spread = blur_mm(model.parameters.edge_blur_mm, lattice.spacing_mm)
        sampling = Sampling(
            lattice.ras_start,
            lattice.spacing_mm / scale,
            np.float32(BAND_MM),
            np.float32(scale / spread),
        )
        scratch = Scratch(
            np.zeros((POINT_ROWS + model.stack_depth, points), dtype=np.float32),
            np.empty((model.mark_rows, points), dtype=np.float32),
            np.empty((model.mark_rows, points), dtype=np.float32),
            np.empty((2, len(model.parts)), dtype=np.bool_),
            np.empty((2, len(model.surroundings)), dtype=np.bool_),
            empty_grids((points,)),
        )
        filling.fill_groups(
            first,
            last,
            edge,
            skipping,
            sampling,
            model.tables,
            scratch,
            grids,
            counters,
        )
        with lock:
            totals[:] += counters

    run_in_ranges(fill, groups, threads, 64, progress)
    if scale != 1.0:
        for grid in (grids.air, grids.gap):
            np.multiply(grid, np.float32(scale), out=grid)
    return grids, Effort(*(int(n) for n in totals))


def blocks_of(
    model: Model, ras: NDArray[np.floating], far: float = np.inf
) -> Iterator[tuple[slice, Floats, Floats, Floats]]:
    """Cut ``(n, 3)`` RAS points into blocks, with scratch for the kernels.

    ras: mm of the unscaled head. Gives each block's place among the points, its points
    ``(3, m)`` in the average head, work, and marks that are `far`.
    """
    rows = POINT_ROWS + model.stack_depth
    for start in range(0, len(ras), _CHUNK):
        block = np.ascontiguousarray(ras[start : start + _CHUNK].T, dtype=np.float32)
        n = block.shape[1]
        displace(block, n, model.tables.spread)
        work = np.zeros((rows, n), dtype=np.float32)
        marks = np.full((model.mark_rows, n), far, dtype=np.float32)
        yield slice(start, start + n), block, work, marks


def evaluate_at_points(model: Model, points_mm: NDArray[np.float64]) -> Grids:
    """Evaluate all that a voxel would know at ``(n, 3)`` LPS points.

    The result's arrays have shape ``(1, 1, n)``; blurred as voxels of no extent are.
    """
    scale = model.parameters.head_scale
    n = len(points_mm)
    grids = empty_grids((n,))
    for at, block, work, marks in blocks_of(model, lps_from_ras(points_mm) / scale):
        size = block.shape[1]
        kernels.evaluate_block(
            block,
            size,
            size,
            np.ones(len(model.parts), dtype=np.bool_),
            np.ones(len(model.surroundings), dtype=np.bool_),
            np.float32(BAND_MM),
            np.float32(scale / model.parameters.edge_blur_mm),
            model.tables,
            work,
            np.empty_like(marks),
            marks,
            Grids._make(grid[at] for grid in grids),
        )
    for grid in (grids.air, grids.gap):
        np.multiply(grid, np.float32(scale), out=grid)
    return Grids._make(grid.reshape(1, 1, n) for grid in grids)


def outside_at_points(
    model: Model, points_mm: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Evaluate the head's outside at ``(n, 3)`` LPS points, as if it had no nostrils.

    Negative in the room; only the zero set is a distance, the skin.
    """
    scale = model.parameters.head_scale
    result = np.empty(len(points_mm), dtype=np.float32)
    begin, end = model.tables.common
    ras = lps_from_ras(np.asarray(points_mm)) / scale
    for at, block, work, marks in blocks_of(model, ras, float(kernels.FAR)):
        unused = np.empty(block.shape[1], dtype=np.float32)
        kernels.evaluate_span(
            block, model.tables, np.float32(0), begin, end, work, marks, unused
        )
        result[at] = marks[Row.FACE]
    return np.float32(scale) * result


def distance_at_points(
    model: Model, points_mm: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Evaluate the model's air function at ``(..., 3)`` LPS points, without a grid."""
    points = checked_points(points_mm)
    scale = model.parameters.head_scale
    ras = lps_from_ras(points.reshape(-1, 3)) / scale
    result = np.empty(len(ras), dtype=np.float32)
    for at, block, work, marks in blocks_of(model, ras):
        kernels.evaluate_points(block, model.tables, work, marks, result[at])
    return scale * result.reshape(points.shape[:-1]).astype(np.float64)


def checked_points(points_mm: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return points as float64; UserError for another shape than ``(..., 3)``."""
    points = np.asarray(points_mm, dtype=np.float64)
    if points.shape[-1:] != (3,):
        raise UserError(f"points must have shape (..., 3), got {points.shape}")
    return points


_NOSE = 1  # the last digit of a nasal cavity's number


def seal_cavities(
    air: NDArray[np.float32], part: NDArray[np.uint8], cavities: list[int]
) -> None:
    """Put tissue between cavities that touch: walls thinner than a voxel, in place.

    cavities: of each part. The two sides' noses and ducts, which do join, are left.
    """
    table = np.zeros(256, np.uint8)
    table[: len(cavities)] = cavities
    cavity = np.where(air < 0, table[part], 0)
    closed = np.zeros(air.shape, np.bool_)
    for axis in range(3):
        ends = [slice(None)] * 3, [slice(None)] * 3
        ends[0][axis], ends[1][axis] = slice(None, -1), slice(1, None)
        first, second = (tuple(end) for end in ends)
        a, b = cavity[first], cavity[second]
        touch = (a > 0) & (b > 0) & (a != b) & ~((a % 10 == _NOSE) & (b % 10 == _NOSE))
        shallow = air[first] > air[second]
        closed[first] |= touch & shallow
        closed[second] |= touch & ~shallow
    air[closed] = -air[closed]


LARGEST_SLIVER_ML = 0.08
"""Less than the smallest ethmoid cell, more than a pocket of a meatus that the
unevenness of its walls has closed."""


def remove_slivers(
    air: NDArray[np.float32], part: NDArray[np.uint8], spacing_mm: float
) -> int:
    """Turn air that is cut off from the nose into tissue, in place; count the pieces.

    The largest component is the airway. Pieces of `LARGEST_SLIVER_ML` and more stay:
    they are sinuses that lost their drainage, which a caller must see. Pieces that
    touch the volume's border stay, too: outside they may be joined to the nose.
    """
    pieces, count = ndimage.label(air < 0)
    if count <= 1:
        return 0
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    limit = LARGEST_SLIVER_ML * 1000 / spacing_mm**3
    small = sizes < limit
    small[0] = False
    small[np.argmax(sizes)] = False
    for axis in range(3):
        ends = np.take(pieces, [0, -1], axis=axis)
        small[np.unique(ends)] = False
    specks = small[pieces]
    air[specks] = -air[specks]
    return int(np.count_nonzero(small))
