"""What rays can read: cells as bricks of value and gradient, and the whole volume."""

import numpy as np
from numpy.typing import NDArray

from renderers.art.cells.cells import CellGrid
from renderers.art.kernels.build_bricks import SHORT, build_brick
from renderers.art.kernels.march_types import ABSENT, CellView, Samples

_FIRST_SLOTS = 64

MOST_VOXELS = 1 << 29
"""Voxels of a volume that is read whole: kernels count up to 2 GiB of samples."""


class Bricks:
    """Keep a brick a slot, made as slots are first filled.

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
    ) -> None:
        """Take the distances of `cube_distances` and the stamps of a `CellCache`.

        span: keep int16, which halves the memory; the largest difference of two
        values, all of them whole numbers that int16 holds. None for float32.
        gradients: False keeps values alone, a quarter of the memory. whole: the volume,
        for a rank that has it and room for it: values are then read from it and no
        cell is looked up; bricks are made for gradients alone.
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
        self.view = CellView(
            top=self._size - 2,
            counts=np.array(grid.counts[::-1], np.int32),
            leap=leap,
            slots=np.full(grid.cells, -1, np.int32),
            corners=np.full(grid.cells, ABSENT, np.int32),
            samples=self._flat(None),
            channels=channels,
            whole=self._flat(whole),
            unit=np.float32(1 if span is None else 1 / SHORT),
            gradient_unit=np.float32(1 if span is None else 1 / (SHORT * scale)),
            stamp=stamp,
        )

    @property
    def bytes(self) -> int:
        """Return the memory of all bricks, of the distances and of the whole volume."""
        view = self.view
        return view.samples.nbytes + view.leap.nbytes + view.whole.nbytes

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
        self.view = self.view._replace(stamp=stamp)

    def shows(self, cell: int) -> bool:
        """Return whether rays can read a cell."""
        return bool(self.view.slots[cell] >= 0)

    def show(self, cell: int, slot: int, block: NDArray[np.generic]) -> None:
        """Make a cell's brick from its raw values with their ghosts.

        Raises IndexError for a slot that the cache has not: kernels check nothing.
        """
        n = self._numbers
        if not 0 <= slot < len(self.view.stamp):
            raise IndexError(
                f"slot {slot} is none of the {len(self.view.stamp)} of the cache"
            )
        if self.view.samples.size < (slot + 1) * n:
            self._grow(slot + 1)
        brick = self.view.samples[slot * n : (slot + 1) * n]
        if self.view.channels == 1:
            brick[:] = block[1:-1, 1:-1, 1:-1].ravel()
        else:
            build_brick(
                np.array(block, dtype=np.float32, order="C"),
                np.array(self.grid.start(cell)[::-1], np.int32),
                self._size,
                self._inverse_spacing,
                brick,
            )
        z, y, x = self.grid.start(cell)
        n = self.grid.side + 1
        self.view.corners[cell] = ((slot * n - z) * n - y) * n - x
        self.view.slots[cell] = slot

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
        _, cy, cx = self.grid.counts
        z, y, x = (
            index * self.grid.side
            for index in (cells // (cy * cx), cells // cx % cy, cells % cx)
        )
        self.view.corners[cells] = ((spare * n - z) * n - y) * n - x
        self.view.slots[cells] = spare

    def _grow(self, slots: int) -> None:
        before = self.view.samples.size // self._numbers
        most = len(self.view.stamp)
        after = min(max(slots, 2 * before, min(_FIRST_SLOTS, most)), most)
        samples = self.view.samples
        added = np.zeros((after - before) * self._numbers, samples.dtype)
        self.view = self.view._replace(samples=np.append(samples, added))

    def _flat(self, values: NDArray[np.generic] | None) -> Samples:
        if values is None or values.size >= MOST_VOXELS:
            values = np.zeros(0, np.int16)
        # A copy, because compiled code tells what may be written from what may not.
        if self.span is None:
            return np.array(values, np.float32).ravel()
        return np.array(values, np.int16).ravel()
