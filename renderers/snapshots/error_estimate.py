"""How far off a picture is that has not all its rays yet, estimated without those.

A picture that had to stop early shows, where a ray is missing, the nearest one of a
coarser picture: it has steps of that one's blocks there. What varies by d from block to
block varies by as much within one, and a step is off by d / sqrt(12) (rms) then. The
parts that were traced correct this: each of their blocks is compared with its own
middle, and the estimate is scaled by the ratio.

A picture of one sample a pixel is off where colour, normal or depth differ from the
neighbours'.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from renderers.scene import GBuffer

LEAST_BLOCKS = 16
"""Traced blocks that a ratio is believed of."""

LARGEST_RATIO = 16.0
"""Of squared errors. Where neighbours are alike a ratio says nothing."""

FLOOR_CODES = 0.5
"""Estimate where neighbours are alike: there is detail finer than a pixel."""

NORMAL_WEIGHT, DEPTH_WEIGHT = 0.5, 0.25
"""What a step in normal or depth counts beside one in colour: an edge may cross a pixel
whose neighbours look alike."""

Scalar = TypeVar("Scalar", bound=np.generic)
Plane = NDArray[np.float64]
Marks = NDArray[np.bool_]


def eye_codes(radiance: NDArray[np.float32], gain: float) -> NDArray[np.float32]:
    """Encode light as the eye weighs it, in codes of 255."""
    light = np.clip(radiance * np.float32(gain), 0, 1)
    return np.asarray(255 * light ** np.float32(1 / 2.2))


def in_field(coverage: NDArray[np.float32]) -> Marks:
    """Mark the pixels ``(h, w)`` of an endoscope's picture that show something.

    Beyond the field's stop nothing is shown.
    """
    half = min(coverage.shape) / 2
    rows, columns = ((np.arange(n) + 0.5 - n / 2) / half for n in coverage.shape)
    inside = np.hypot(rows[:, None], columns[None]) <= 1
    return np.asarray((coverage > 0) & inside)


def stopped_error(
    codes: NDArray[np.float32], drawn: Marks, block_px: int, counted: Marks
) -> float:
    """Estimate the root mean square error of a picture, in its own units.

    codes: ``(h, w, c)`` as shown. drawn: ``(h, w)``, pixels whose rays were all traced.
    block_px: edge of the blocks that the others show. counted: ``(h, w)``, pixels that
    the mean is over.
    """
    if not (counted & ~drawn).any():
        return 0.0
    edge = min(block_px, *drawn.shape)
    exact = codes.astype(np.float64)
    pixels = block_sums(np.ones(drawn.shape), edge)
    guess = _step_errors(block_sums(exact, edge) / pixels[..., None])
    marked = block_sums((drawn & counted).astype(np.float64), edge)
    known = (pixels == edge**2) & (marked == pixels)
    ratio = 1.0
    if np.count_nonzero(known) >= LEAST_BLOCKS:
        guessed = float(guess[known].sum())
        true = float((_variation(exact, edge) / pixels)[known].sum())
        if guessed > 0:
            ratio = float(np.clip(true / guessed, 1 / LARGEST_RATIO, LARGEST_RATIO))
    missing = block_sums((~drawn & counted).astype(np.float64), edge)
    mean = (guess * missing).sum() / np.count_nonzero(counted)
    return float(np.sqrt(ratio * mean))


def sample_error(gbuffer: GBuffer, codes: NDArray[np.float32], counted: Marks) -> Plane:
    """Estimate each pixel's error, but for a scale, ``(h, w)`` codes.

    gbuffer, codes: of a picture of one sample a pixel. The estimate is 0 where a pixel
    is not counted.
    """
    shown = gbuffer.coverage > 0
    depth = np.log(np.where(shown, gbuffer.depth_mm, np.float32(1e3)))
    bright = codes.mean(axis=-1)
    total = np.zeros(shown.shape, np.float32)
    for axis in (0, 1):
        # light that rises evenly is right in the middle of a pixel
        bend = np.zeros_like(codes)
        rise = np.diff(codes, axis=axis) / 2
        first, last = _halves(axis)
        bend[first] -= rise
        bend[last] += rise
        total += np.einsum("ijk,ijk->ij", bend, bend) / 3
        normal = gbuffer.normal
        turn = 1 - np.einsum("ijk,ijk->ij", normal[first], normal[last])
        turn = np.clip(turn, 0, 1) * (shown[first] & shown[last])
        step = np.minimum(np.abs(np.diff(depth, axis=axis)), 1)
        edge = (NORMAL_WEIGHT * turn + DEPTH_WEIGHT * step) ** 2 / 2
        total[first] += edge * bright[first] ** 2
        total[last] += edge * bright[last] ** 2
    guess = np.sqrt(np.where(counted, total / 2 + FLOOR_CODES**2, 0))
    return np.asarray(guess, np.float64)


def block_sums(plane: Plane, edge: int) -> Plane:
    """Add up the squares of a picture, which may be cut off at its far edges."""
    for axis in (0, 1):
        starts = np.arange(0, plane.shape[axis], edge)
        plane = np.asarray(np.add.reduceat(plane, starts, axis=axis))
    return plane


def spread_blocks(
    blocks: NDArray[Scalar], edge: int, size: tuple[int, ...]
) -> NDArray[Scalar]:
    """Return the value of each pixel's block."""
    whole = np.repeat(np.repeat(blocks, edge, axis=0), edge, axis=1)
    return np.ascontiguousarray(whole[: size[0], : size[1]])


def _step_errors(means: Plane) -> Plane:
    """Estimate each block's mean squared error if it has one colour."""
    total = np.zeros(means.shape[:2])
    for axis in (0, 1):
        step = (np.diff(means, axis=axis) ** 2).mean(axis=-1) / 12
        # a block has two neighbours along an axis, or one at the edge
        sums, sides = np.zeros_like(total), np.zeros_like(total)
        for half in _halves(axis):
            sums[half] += step
            sides[half] += 1
        total += sums / np.maximum(sides, 1)
    return total


def _variation(exact: Plane, edge: int) -> Plane:
    """Add up each block's squared distances from its middle."""
    at = []
    for length in exact.shape[:2]:
        starts = np.arange(0, length, edge)
        middles = np.stack([starts + (edge - 1) // 2, starts + edge // 2])
        at.append(np.minimum(middles, length - 1))
    rows, columns = at
    middle = exact[rows[:, :, None, None], columns[None, None]].mean(axis=(0, 2))
    spread = spread_blocks(middle, edge, exact.shape)
    return block_sums(((exact - spread) ** 2).mean(axis=-1), edge)


def _halves(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return all but the last, and all but the first, along one of two axes."""
    before, after = [slice(None)] * 2, [slice(None)] * 2
    before[axis], after[axis] = slice(None, -1), slice(1, None)
    return tuple(before), tuple(after)
