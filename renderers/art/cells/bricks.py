"""What rays can read: cells as bricks of value and gradient, and the whole volume."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from renderers.art.cells.cells import CellGrid
from renderers.art.crew import ALONE, Crew
from renderers.art.kernels.build_bricks import LANES, SHORT, build_brick, build_bricks
from renderers.art.kernels.march_types import ABSENT, CellView, Samples

_CELLS_A_PART = 16
"""Whose bricks a thread makes in one go."""

MOST_VOXELS = 1 << 29
"""Voxels of a volume that is read whole: kernels count up to 2 GiB of samples."""


class Bricks:
    """Keep a brick a slot. What no brick was made in takes no memory.

    A brick is ``(side + 1)**3`` voxels of (value, gradient x y z), or of values alone
    where nothing is shaded, in float32 or int16.
    """

    def __init__(
        self,
        grid: CellGrid,
        spacing_mm: NDArray[np.float64],
        leap: NDArray[np.uint8],
        stamp: NDArray[np.int64],
        span: float | None = None,
        *,
        gradients: bool = True,
        whole: NDArray[np.generic] | None = None,
        crew: Crew = ALONE,
    ) -> None:
        """Take the distances of `cube_distances` and the stamps of a `CellCache`.

        span: keep int16, which halves the memory; the largest difference of two
        values, all of them whole numbers that int16 holds. None for float32.
        gradients: False keeps values alone, a quarter of the memory. whole: the volume,
        for a rank that has it and room for it: values are then read from it and no
        cell is looked up; bricks are made for gradients alone. crew: has one copy of
        them, to which each adds.
        """
        self.grid = grid
        self.span = span
        scale = 1.0
        if span is not None:
            # No difference over one voxel, as faces have it, leaves int16.
            scale = float(SHORT * np.min(spacing_mm) / max(span, 1.0))
        self._inverse_spacing = (scale / np.asarray(spacing_mm)).astype(np.float32)
        self._size = np.array(grid.shape[::-1], np.int32)
        channels = 4 if gradients else 1
        self._numbers = (grid.side + 1) ** 3 * channels
        self._crew = crew
        slots: NDArray[np.int32] = crew.empty(grid.cells, np.int32)
        corners: NDArray[np.int32] = crew.empty(grid.cells, np.int32)

        def begin() -> None:
            slots[:], corners[:] = -1, ABSENT

        crew.once(begin)
        self.view = CellView(
            top=self._size - 2,
            counts=np.array(grid.counts[::-1], np.int32),
            leap=leap,
            slots=slots,
            corners=corners,
            samples=self._room(len(stamp)),
            channels=channels,
            whole=self._flat(whole),
            unit=np.float32(1 if span is None else 1 / SHORT),
            gradient_unit=np.float32(1 if span is None else 1 / (SHORT * scale)),
            stamp=stamp,
        )

    @property
    def brick_bytes(self) -> int:
        """Return the memory of one brick."""
        return self._numbers * self.view.samples.itemsize

    @property
    def bytes(self) -> int:
        """Return the memory of all bricks, of the distances and of the whole volume."""
        view = self.view
        filled = len(np.unique(view.slots[view.slots >= 0]))
        return filled * self.brick_bytes + view.leap.nbytes + view.whole.nbytes

    def follow(
        self,
        values: NDArray[np.generic],
        low: NDArray[np.int64],
        high: NDArray[np.int64],
    ) -> None:
        """Take what was edited in a box of the volume; its bricks come one by one.

        low, high: its first and last voxel, (k, j, i). The distances are brought up to
        date by whoever made them, in place.
        """
        if self.view.whole.size:
            here = tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))
            self.view.whole.reshape(values.shape)[here] = values[here]

    def use(self, stamp: NDArray[np.int64]) -> None:
        """Take the stamps of a cache that has grown."""
        samples = self.view.samples
        more = len(stamp) * self._numbers - samples.size
        if more > 0:
            samples = np.append(samples, np.empty(more, samples.dtype))
        self.view = self.view._replace(stamp=stamp, samples=samples)

    def shows(self, cell: int) -> bool:
        """Return whether rays can read a cell."""
        return bool(self.view.slots[cell] >= 0)

    def show(self, cell: int, slot: int, block: NDArray[np.generic]) -> None:
        """Make a cell's brick from its raw values with their ghosts.

        Raises IndexError for a slot that the cache has not: kernels check nothing.
        """
        n = self._numbers
        self._require(slot)
        brick = self.view.samples[slot * n : (slot + 1) * n]
        if self.view.channels == 1:
            brick[:] = block[1:-1, 1:-1, 1:-1].ravel()
        else:
            wide = np.zeros((*block.shape[:2], block.shape[2] + LANES), np.float32)
            wide[:, :, :-LANES] = block
            build_brick(
                wide,
                np.array(self.grid.start(cell)[::-1], np.int32),
                self._size,
                self._inverse_spacing,
                brick,
            )
        self._point(np.array([cell]), slot)

    def show_all(
        self,
        cells: NDArray[np.int64],
        slots: NDArray[np.int64],
        values: NDArray[np.generic],
    ) -> None:
        """Make many cells' bricks from the volume; otherwise as `show`.

        What another of the crew has made meanwhile is left as it is. Where two make the
        same, both write the same.
        """
        missing = self.view.slots[cells] < 0
        cells, slots = cells[missing], slots[missing]
        if not len(cells):
            return
        if values.dtype == np.float16 or not values.dtype.isnative:
            for cell, slot in zip(cells.tolist(), slots.tolist(), strict=True):
                self.show(cell, slot, self.grid.block(values, cell))
            return
        self._require(int(slots.min()))
        self._require(int(slots.max()))
        # neighbours one after the other: they are read from the same rows of voxels
        order = np.argsort(cells)
        cells, slots = cells[order], slots[order]
        starts = np.stack(self._starts(cells), axis=-1)
        values = np.asarray(values)

        def build(first: int) -> None:
            here = slice(first, first + _CELLS_A_PART)
            build_bricks(
                values, starts[here], slots[here], self.grid.side, self._size,
                self._inverse_spacing, self.view.channels, self.view.samples,
            )  # fmt: skip

        deque(self._crew.run(build, range(0, len(cells), _CELLS_A_PART)), 0)
        self._point(cells, slots)

    def hide(self, cell: int) -> None:
        """Let rays stop at a cell again."""
        self.view.slots[cell] = -1
        self.view.corners[cell] = ABSENT

    def show_empty(self, cells: NDArray[np.int64], value: float) -> None:
        """Let rays pass through cells in which nothing can be seen, without leaps.

        One brick that holds `value` everywhere serves them all; it takes the last slot.
        """
        n = self.grid.side + 1
        spare = len(self.view.stamp) - 1
        self.show(int(cells[0]), spare, np.full((n + 2,) * 3, value))
        self._point(cells, spare)

    def _require(self, slot: int) -> None:
        if not 0 <= slot < len(self.view.stamp):
            raise IndexError(
                f"slot {slot} is none of the {len(self.view.stamp)} of the cache"
            )

    def _starts(
        self, cells: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Return the first voxels of cells, z, y and x."""
        _, cy, cx = self.grid.counts
        side = self.grid.side
        return cells // (cy * cx) * side, cells // cx % cy * side, cells % cx * side

    def _point(self, cells: NDArray[np.int64], slots: NDArray[np.int64] | int) -> None:
        """Let rays find the cells' values in their slots."""
        n = self.grid.side + 1
        z, y, x = self._starts(cells)
        self.view.corners[cells] = ((slots * n - z) * n - y) * n - x
        self.view.slots[cells] = slots

    def _room(self, slots: int) -> Samples:
        # not zeros: numpy asks for large pages for those that are empty alone, and in
        # small ones half a gigabyte takes most of a second to be first touched
        if self.span is None:
            floats: NDArray[np.float32] = self._crew.empty(
                slots * self._numbers, np.float32
            )
            return floats
        shorts: NDArray[np.int16] = self._crew.empty(slots * self._numbers, np.int16)
        return shorts

    def _flat(self, values: NDArray[np.generic] | None) -> Samples:
        if values is None or values.size >= MOST_VOXELS:
            values = np.zeros(0, np.int16)
        # A copy, because compiled code tells what may be written from what may not.
        if self.span is None:
            return np.array(values, np.float32).ravel()
        return np.array(values, np.int16).ravel()
