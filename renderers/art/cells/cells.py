"""The volume cut into cells, each with the ghost layers its samples need.

A cell owns ``side**3`` cubes between voxel centres, hence ``(side + 1)**3`` voxels;
one more voxel on either side makes its gradients, so ``(side + 3)**3`` values travel.
A point on a face shared by two cells belongs to the cell with the larger index.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.art.crew import ALONE, Crew
from renderers.art.kernels.build_bricks import (
    chebyshev,
    find_clear,
    find_clear_cubes,
    join_slabs,
    sum_blocks,
)
from system import UserError

SIDES = (8, 16, 32)
"""Cell sides, in cubes. Powers of two, so that a voxel's cell is a shift away."""

_LAYERS = 48


@dataclass(frozen=True, slots=True)
class CellGrid:
    """Which voxels belong to which cell.

    shape: voxels ``(nz, ny, nx)``. side: cubes along a cell's edge.
    Cells are numbered with x fastest, then y, then z.
    """

    shape: tuple[int, int, int]
    side: int = 8

    def __post_init__(self) -> None:
        if self.side not in SIDES:
            raise UserError(f"cell side must be one of {SIDES}, got {self.side!r}")
        if len(self.shape) != 3 or min(self.shape) < 2:
            raise UserError(f"a grid needs at least 2 voxels an axis: {self.shape}")

    @property
    def shift(self) -> int:
        """Return the binary logarithm of `side`."""
        return self.side.bit_length() - 1

    @property
    def counts(self) -> tuple[int, int, int]:
        """Return the number of cells along z, y, x."""
        nz, ny, nx = self.shape
        s = self.side
        return -(-(nz - 1) // s), -(-(ny - 1) // s), -(-(nx - 1) // s)

    @property
    def cells(self) -> int:
        """Return the number of cells."""
        cz, cy, cx = self.counts
        return cz * cy * cx

    def start(self, cell: int) -> tuple[int, int, int]:
        """Return the first voxel ``(z, y, x)`` of a cell."""
        _, cy, cx = self.counts
        if not 0 <= cell < self.cells:
            raise UserError(f"there is no cell {cell}; the volume has {self.cells}")
        s = self.side
        return cell // (cy * cx) * s, cell // cx % cy * s, cell % cx * s

    def block(self, values: NDArray[np.generic], cell: int) -> NDArray[np.generic]:
        """Copy a cell's values with its ghosts, ``(side + 3,) * 3``.

        Beyond the volume's faces the outermost voxel is repeated.
        """
        width = self.side + 3
        where = [
            np.clip(np.arange(first - 1, first - 1 + width), 0, size - 1)
            for first, size in zip(self.start(cell), self.shape, strict=True)
        ]
        if all(w[-1] - w[0] == width - 1 for w in where):
            inner = tuple(slice(int(w[0]), int(w[0]) + width) for w in where)
            return np.ascontiguousarray(values[inner])
        return values[np.ix_(*where)]

    def touched(
        self, low: NDArray[np.int64], high: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """List the cells whose blocks, ghosts included, hold a voxel of a box.

        low, high: its first and last voxel, (k, j, i).
        """
        # Cell c has the voxels c * side - 1 to c * side + side + 1.
        first = np.maximum(-((self.side + 1 - low) // self.side), 0)
        last = np.minimum((high + 1) // self.side, np.array(self.counts) - 1)
        z, y, x = (
            np.arange(min(a, b), b + 1) for a, b in zip(first, last, strict=True)
        )
        _, cy, cx = self.counts
        found = (z[:, None, None] * cy + y[:, None]) * cx + x
        return np.asarray(found.ravel(), np.int64)

    def new_ranges(
        self,
        ranges: NDArray[np.float32],
        values: NDArray[np.generic],
        low: NDArray[np.int64],
        high: NDArray[np.int64],
    ) -> NDArray[np.float32]:
        """Return `value_ranges` of a volume edited in a box, from those before.

        low, high: as in `touched`.
        """
        first = np.maximum(low - 1, 0) // self.side
        last = np.minimum(high // self.side, np.array(self.counts) - 1)
        cells = _slices(first, last + 1)
        part = values[_slices(first * self.side, (last + 1) * self.side + 1)]
        grid = CellGrid(part.shape, self.side)
        after = ranges.copy()
        after.reshape(*self.counts, 2)[cells] = grid.value_ranges(part).reshape(
            *grid.counts, 2
        )
        return after

    def value_ranges(
        self, values: NDArray[np.generic], crew: Crew = ALONE
    ) -> NDArray[np.float32]:
        """Return the smallest and largest value of each cell, ``(cells, 2)``.

        Layer by layer: of a mapped file no more is in memory than one layer of cells a
        thread. crew: shares out the layers.
        """
        found: NDArray[np.float32] = crew.empty((2, *self.counts), np.float32)

        def look(layer: int) -> None:
            # A cell shares its last voxel with the next cell.
            slab = values[layer * self.side : (layer + 1) * self.side + 1]
            for k, pick in enumerate((np.minimum, np.maximum)):
                best = pick.reduce(slab, axis=0)
                for axis in range(2):
                    size = self.shape[axis + 1]
                    starts = np.arange(0, size - 1, self.side)
                    after = np.minimum(starts + self.side, size - 1)
                    best = pick(
                        pick.reduceat(best, starts, axis=axis),
                        np.take(best, after, axis=axis),
                    )
                found[k, layer] = best

        crew.share(look, range(self.counts[0]))
        return np.stack([found[0].ravel(), found[1].ravel()], axis=-1)

    def occupied(
        self, ranges: NDArray[np.float32], clear: NDArray[np.float32]
    ) -> NDArray[np.bool_]:
        """Tell which cells may hold something to be seen, ``(cells,)``.

        clear: ``(k, 2)`` intervals of values that cannot be seen.
        """
        empty = np.zeros(self.cells, np.uint8)
        find_clear(ranges, clear, empty)
        full: NDArray[np.bool_] = empty == 0
        return full

    def clearest(
        self, ranges: NDArray[np.float32], clear: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Choose the one of some intervals that empties the most cells, ``(1, 2)``."""
        cells = [
            int(np.count_nonzero(self.occupied(ranges, clear[k : k + 1])))
            for k in range(len(clear))
        ]
        return clear[[int(np.argmin(cells))]] if cells else clear

    def beside(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Tell which cells are chosen ones or touch one, ``(cells,)``."""
        found = chosen.reshape(self.counts).copy()
        for axis in range(3):
            line = np.moveaxis(found, axis, 0)
            before = line.copy()
            line[1:] |= before[:-1]
            line[:-1] |= before[1:]
        return found.ravel()

    def mark_cubes(
        self,
        found: NDArray[np.bool_],
        distance: NDArray[np.uint8],
        margin: int,
        low: NDArray[np.int64],
        high: NDArray[np.int64],
    ) -> None:
        """Bring up to date which cells have cubes that are so near to something.

        found: what `with_cubes` gave for distances up to the margin, changed in place.
        low, high: the first and last cube, (k, j, i), whose distance is another now.
        """
        first, last = low // self.side, high // self.side
        near = distance[_slices(first * self.side, (last + 1) * self.side)] <= margin
        cells = found.reshape(self.counts)[_slices(first, last + 1)]
        cells[...] = self._any_of(near).reshape(cells.shape)

    def with_cubes(self, cubes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Tell which cells have any of some cubes, ``(cells,)``.

        cubes: of the volume's shape, less one along each axis.
        """
        return self._any_of(cubes).ravel()

    def _any_of(self, cubes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        for axis, size in enumerate(cubes.shape):
            starts = np.arange(0, size, self.side)
            cubes = np.logical_or.reduceat(cubes, starts, axis=axis)
        return cubes


def _slices(low: NDArray[np.int64], end: NDArray[np.int64]) -> tuple[slice, ...]:
    return tuple(slice(a, b) for a, b in zip(low.tolist(), end.tolist(), strict=True))


def cube_distances(
    values: NDArray[np.generic], clear: NDArray[np.float32], crew: Crew = ALONE
) -> NDArray[np.uint8]:
    """Return each cube's Chebyshev distance, in cubes, to the next one to be seen.

    Flat, x fastest, with three bytes to spare. Zero marks cubes that may hold
    something; distances saturate at 255. Whatever is clear in `CellGrid.occupied` is
    here. crew: shares out the layers.
    """
    shape = tuple(n - 1 for n in values.shape)
    flat: NDArray[np.uint8] = crew.empty(math.prod(shape) + 3, np.uint8)
    flat[-3 if len(clear) else 0 :] = 0
    if len(clear):
        distance = flat[:-3].reshape(shape)

        def look(z: int) -> None:
            # of a mapped file no more than this is in memory
            slab = np.array(values[z : z + _LAYERS + 1], np.float32, order="C")
            find_clear_cubes(slab, clear, distance[z : z + _LAYERS])
            chebyshev(distance[z : z + _LAYERS])

        crew.share(look, range(0, shape[0], _LAYERS))
        crew.once(lambda: join_slabs(distance, _LAYERS))
    return flat


def follow_distances(
    flat: NDArray[np.uint8],
    values: NDArray[np.generic],
    clear: NDArray[np.float32],
    low: NDArray[np.int64],
    high: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Bring `cube_distances` of a volume up to date after an edit in a box, in place.

    low, high: first and last edited voxel, (k, j, i). Return the first and last cube
    whose distance may be another now, None for none.
    """
    top = np.array(values.shape) - 2
    distance = flat[:-3].reshape(top + 1)
    first, last = np.maximum(low - 1, 0), np.minimum(high, top)
    here = _slices(first, last + 1)
    part = np.array(values[_slices(first, last + 2)], np.float32, order="C")
    found = np.empty(distance[here].shape, np.uint8)
    find_clear_cubes(part, clear, found)
    places = np.argwhere((found > 0) != (distance[here] > 0))
    if not len(places):
        return None
    first, last = first + places.min(axis=0), first + places.max(axis=0)
    # A cube whose distance is shorter than that to the box has what it is measured to
    # elsewhere, and nothing in the box can be nearer. Where that holds all round at one
    # distance from the box it holds farther away, since neighbours differ by 1 at most.
    reach = 1
    while (farthest := _shell(distance, first - reach, last + reach)) >= reach:
        reach += 1 + (farthest - reach) // 2
    distance[here] = np.where(found > 0, np.maximum(distance[here], 1), 0)
    begin, end = np.maximum(first - reach, 0), np.minimum(last + reach, top)
    inner = _slices(
        np.maximum(first - reach + 1, 0) - begin,
        np.minimum(last + reach - 1, top) - begin + 1,
    )
    region = distance[_slices(begin, end + 1)].copy()
    region[inner] = np.where(region[inner] > 0, np.uint8(255), np.uint8(0))
    chebyshev(region)
    distance[_slices(begin, end + 1)] = region
    return begin, end


def _shell(
    distance: NDArray[np.uint8], low: NDArray[np.int64], high: NDArray[np.int64]
) -> int:
    """Return the largest value on a box's faces, -1 where all are outside."""
    top = np.array(distance.shape) - 1
    box = _slices(np.maximum(low, 0), np.minimum(high, top) + 1)
    most = -1
    for axis in range(3):
        for at in (int(low[axis]), int(high[axis])):
            if 0 <= at <= top[axis]:
                face = (*box[:axis], slice(at, at + 1), *box[axis + 1 :])
                most = max(most, int(distance[face].max()))
    return most


def may_change(values: NDArray[np.generic]) -> bool:
    """Return whether an array, or one that it is a view of, can be written to."""
    owner: object = values
    while isinstance(owner, np.ndarray):
        if owner.flags.writeable:
            return True
        owner = owner.base
    return False


def _sums_of(
    values: NDArray[np.generic], starts: list[tuple[int, int, int]], width: int
) -> NDArray[np.uint64]:
    """Sum the bits of blocks that begin a voxel before `starts` (z, y, x)."""
    found = np.empty(len(starts), np.uint64)
    bits = values.view(np.dtype(f"u{values.itemsize}"))
    sum_blocks(bits, np.array(starts, np.int64).reshape(-1, 3), width, found)
    return found


class CellShare:
    """The raw cells that one rank keeps for others.

    A rank on its own keeps the volume itself and cuts blocks when asked; one of many
    copies its own cells, and the rest of the volume need not be in its memory. Where
    the volume's array can be written to, by whoever made it, blocks are cut later only
    if they are still what they were: a picture is never made of two volumes.
    """

    def __init__(
        self,
        grid: CellGrid,
        values: NDArray[np.generic],
        cells: NDArray[np.int64] | None,
        *,
        wanted: NDArray[np.bool_] | None = None,
    ) -> None:
        """Keep `cells` of a volume, or the whole volume when `cells` is None.

        wanted: the cells that may be asked for, ``(cells,)``; None for all.
        """
        self.grid = grid
        self._wanted = np.ones(grid.cells, np.bool_) if wanted is None else wanted
        self.dtype = values.dtype
        self.is_whole = cells is None
        """Whether blocks are cut from the volume when they are asked for."""
        self._blocks: dict[int, NDArray[np.generic]] = {}
        self.replace(values)
        if cells is not None:
            self._blocks = {int(c): grid.block(values, int(c)) for c in cells}

    def __len__(self) -> int:
        """Count the blocks that lie apart from the volume."""
        return len(self._blocks)

    def replace(self, values: NDArray[np.generic]) -> None:
        """Cut later blocks from other values: the volume after an edit."""
        if values.shape != self.grid.shape or values.dtype != self.dtype:
            raise UserError(
                f"values {values.shape} of {values.dtype} do not fit the grid "
                f"{self.grid.shape} of {self.dtype}"
            )
        # For many ranks this is a mapped file: what is not read takes no memory.
        self._values = values
        self._sums: NDArray[np.uint64] | None = None
        if self.is_whole and may_change(values):
            self._sums = np.zeros(self.grid.cells, np.uint64)
            chosen = np.flatnonzero(self._wanted)
            starts = [self.grid.start(int(cell)) for cell in chosen]
            self._sums[chosen] = _sums_of(values, starts, self.grid.side + 3)

    def follow(
        self,
        values: NDArray[np.generic],
        cells: NDArray[np.int64],
    ) -> None:
        """Cut later blocks from values that were edited in some cells, ghosts included.

        Blocks that lie apart from the volume are cut anew by `renew`.
        """
        self._wanted[cells] = True
        if self._sums is None and not (self.is_whole and may_change(values)):
            self._values = values
            return
        if self._sums is None or not may_change(values):
            self.replace(values)
            return
        self._values = values
        starts = [self.grid.start(int(cell)) for cell in cells]
        self._sums[cells] = _sums_of(values, starts, self.grid.side + 3)

    @property
    def values(self) -> NDArray[np.generic]:
        """Return the volume that blocks are cut from."""
        return self._values

    def block(self, cell: int) -> NDArray[np.generic]:
        """Return a cell's block; raise KeyError when another rank keeps it.

        Raise UserError where the volume's array was edited since it was taken.
        """
        if not self.is_whole:
            return self._blocks[cell]
        self.require(np.array([cell]))
        return self.read(cell)

    def require(self, cells: NDArray[np.int64]) -> None:
        """Raise UserError where the volume was edited in some cells since it was taken.

        Of those only that were wanted.
        """
        if self._sums is None:
            return
        chosen = cells[self._wanted[cells]]
        starts = [self.grid.start(int(cell)) for cell in chosen]
        found = _sums_of(self._values, starts, self.grid.side + 3)
        for cell in chosen[found != self._sums[chosen]]:
            raise UserError(
                f"the volume's array was edited while it was drawn (cell {cell} is "
                "another now); edit a copy and make a scene of it"
            )

    def read(self, cell: int) -> NDArray[np.generic]:
        """Cut a cell's block from the volume, whoever keeps it."""
        return self.grid.block(self._values, cell)

    def keep(self, cells: NDArray[np.int64]) -> None:
        """Keep cells for others that were empty before."""
        if not self.is_whole:
            self._blocks |= {int(cell): self.read(int(cell)) for cell in cells}

    def put(self, cell: int, block: NDArray[np.generic]) -> None:
        """Keep a block that came from another rank."""
        self._blocks[cell] = block

    def drop(self, cell: int) -> None:
        """Keep a block no longer."""
        self._blocks.pop(cell, None)

    def renew(self, cell: int) -> None:
        """Cut a block anew if this rank keeps it."""
        if cell in self._blocks:
            self._blocks[cell] = self.read(cell)

    def decode(self, payload: bytes) -> NDArray[np.generic]:
        """Read a block back from the bytes of a Data message."""
        width = self.grid.side + 3
        return np.frombuffer(payload, self.dtype).reshape(width, width, width)
