"""Read between eight voxels of a brick, one ray at a time.

The operations are those of `renderers.simd.cell4`, in its order.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.opacity_scalar import HALF

U = np.uintp
"""Makes an index unsigned, so that numba does not look whether it counts from the end:
5 % of the whole march (measured)."""

SHORT = np.float32(32767)
"""What values and gradients in int16 are multiplied by while they are interpolated."""


@njit(cache=True, nogil=True, error_model="numpy")
def _line(samples: NDArray[Any], at: int, next_: int, fx: np.float32) -> np.float32:
    """Interpolate between two voxels along x."""
    a, b = np.float32(samples[U(at)]), np.float32(samples[U(at + next_)])
    return a + fx * (b - a)


@njit(cache=True, nogil=True, error_model="numpy")
def _across(
    samples: NDArray[Any], at: int, row: int, slab: int, w: int, fz: np.float32
) -> np.float32:
    """Interpolate four voxels along y, in whole numbers, and z."""
    q, u = at + slab, int(SHORT) - w
    a = np.float32(int(samples[U(at)]) * u + int(samples[U(at + row)]) * w)
    b = np.float32(int(samples[U(q)]) * u + int(samples[U(q + row)]) * w)
    return a + fz * (b - a)


@njit(cache=True, nogil=True, error_model="numpy")
def trilinear(
    samples: NDArray[Any], at: int, next_: int, row: int, slab: int,
    fx: np.float32, fy: np.float32, fz: np.float32,
) -> np.float32:  # fmt: skip
    """Interpolate one channel of interleaved samples between eight voxels.

    next_, row, slab: numbers from a voxel to the next along x, y and z.

    float32: along x, then y, then z. int16: 32767 times as much; y in whole numbers,
    then z, then x.
    """
    if samples.itemsize == 2:
        w = int(fy * SHORT + HALF)
        left = _across(samples, at, row, slab, w, fz)
        right = _across(samples, at + next_, row, slab, w, fz)
        return left + fx * (right - left)
    front = _line(samples, at, next_, fx)
    front += fy * (_line(samples, at + row, next_, fx) - front)
    back = _line(samples, at + slab, next_, fx)
    back += fy * (_line(samples, at + slab + row, next_, fx) - back)
    return front + fz * (back - front)
