"""What the projection's kernel says of optical depths, sixteen at a time."""

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from renderers.fsr.kernels.footprint import peak_of
from renderers.simd import load, store

F32 = NDArray[np.float32]


@njit(error_model="numpy")
def _find(depths: F32, found: F32) -> None:
    for k in range(0, len(depths), 16):
        store(found, k, peak_of(load(depths, k, 16)))


def kernel_peaks(depths: ArrayLike) -> F32:
    """Give the kernel's peaks for optical depths."""
    given = np.atleast_1d(np.asarray(depths, np.float32))
    padded = np.zeros(-(-len(given) // 16) * 16, np.float32)
    padded[: len(given)] = given
    found = np.zeros_like(padded)
    _find(padded, found)
    return found[: len(given)]
