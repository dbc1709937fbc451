"""How far off a picture is whose rays were not all traced when it had to be delivered.

Where a ray is missing, the nearest one of a coarser picture stands for it: the picture
has steps of that one's blocks there. What varies by d from block to block varies by as
much within one, and a step is off by d / sqrt(12) (rms) then. The parts that were
traced tell what it really is: each of their blocks is held against its own middle, and
the estimate is put right by the ratio.
"""

import numpy as np
from numpy.typing import NDArray

LEAST_BLOCKS = 16
"""Traced blocks that a ratio is believed of."""

LARGEST_RATIO = 16.0
"""Of squared errors. Where neighbours are alike a ratio says nothing."""

Plane = NDArray[np.float64]


def stopped_error(
    codes: NDArray[np.float32],
    drawn: NDArray[np.bool_],
    block_px: int,
    counted: NDArray[np.bool_],
) -> float:
    """Estimate the root mean square error of a picture, in its own units.

    codes: ``(h, w, c)`` as shown. drawn: ``(h, w)``, pixels whose rays were all traced.
    block_px: edge of the blocks that the others show. counted: ``(h, w)``, pixels that
    the mean is over.
    """
    if not (counted & ~drawn).any():
        return 0.0
    blocks = _Blocks(drawn.shape, block_px)
    guess = blocks.steps(codes)
    known = blocks.all_of(drawn & counted)
    ratio = 1.0
    if np.count_nonzero(known) >= LEAST_BLOCKS:
        guessed = float(guess[known].sum())
        true = float(blocks.spread(codes)[known].sum())
        if guessed > 0:
            ratio = float(np.clip(true / guessed, 1 / LARGEST_RATIO, LARGEST_RATIO))
    missing = blocks.count_of(~drawn & counted)
    mean = (guess * missing).sum() / np.count_nonzero(counted)
    return float(np.sqrt(ratio * mean))


class _Blocks:
    """Cut a picture into squares, which may be cut off at its far edges."""

    def __init__(self, size: tuple[int, int], edge: int) -> None:
        self._size = size
        self._edge = min(edge, *size)
        self._pixels = self._sums(np.ones(size))

    def _sums(self, plane: Plane) -> Plane:
        for axis in (0, 1):
            starts = np.arange(0, self._size[axis], self._edge)
            plane = np.add.reduceat(plane, starts, axis=axis)
        return plane

    def count_of(self, marked: NDArray[np.bool_]) -> Plane:
        """Count the marked pixels of each block."""
        return self._sums(marked.astype(np.float64))

    def all_of(self, marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Tell which blocks are whole, and marked everywhere."""
        full = self._pixels == self._edge**2
        return np.asarray(full & (self.count_of(marked) == self._pixels))

    def steps(self, codes: NDArray[np.float32]) -> Plane:
        """Give each block's mean squared error if it has one colour."""
        means = self._sums(codes.astype(np.float64)) / self._pixels[..., None]
        total = np.zeros(self._pixels.shape)
        for axis in (0, 1):
            step = (np.diff(means, axis=axis) ** 2).mean(axis=-1) / 12
            # a block has two neighbours along an axis, or one at the edge
            sums, sides = np.zeros_like(total), np.zeros_like(total)
            first, last = [slice(None)] * 2, [slice(None)] * 2
            first[axis], last[axis] = slice(None, -1), slice(1, None)
            for half in (tuple(first), tuple(last)):
                sums[half] += step
                sides[half] += 1
            total += sums / np.maximum(sides, 1)
        return total

    def spread(self, codes: NDArray[np.float32]) -> Plane:
        """Give the mean squared distance of a block's pixels from its middle."""
        exact = codes.astype(np.float64)
        at = []
        for axis in (0, 1):
            starts = np.arange(0, self._size[axis], self._edge)
            near = starts + (self._edge - 1) // 2
            far = starts + self._edge // 2
            at.append(np.minimum(np.stack([near, far]), self._size[axis] - 1))
        rows, columns = at
        middle = exact[rows[:, :, None, None], columns[None, None]].mean(axis=(0, 2))
        spread = np.repeat(np.repeat(middle, self._edge, axis=0), self._edge, axis=1)
        spread = spread[: self._size[0], : self._size[1]]
        return self._sums(((exact - spread) ** 2).mean(axis=-1)) / self._pixels
