"""Compiled: which cubes of voxels have a cut surface, or blood on a surface."""

import numpy as np
from numba import njit

from renderers.simd.arrays import Bytes, Floats, Longs, f32

CUT, WET = 1, 2
"""Bits of what a cube has: a cut surface, blood on a surface."""

LEAST_DEPTH_MM = 0.02
"""What lies less deep below the surface that was is not cut."""


@njit(cache=True, nogil=True, error_model="numpy")
def mark_cubes(
    distance: Floats, pristine: Floats, film: Bytes, near: np.float32, cubes: Bytes,
    shift: int, around: int, low: Longs, high: Longs,
) -> None:  # fmt: skip
    """Find out again what cubes have, in a box.

    distance, pristine: ``(nz, ny, nx)`` mm, now and before anything was cut. film:
    thickness of blood. near: mm, no corner of a cell with a surface in it is farther
    from that. cubes: ``(nc, nb, na)``, of ``2**shift`` voxels a side, which have what
    so many voxels `around` them have, too. low, high: the first and last voxel
    (i, j, k) of what has changed.
    """
    side = 1 << shift
    first = np.empty(3, np.int64)
    last = np.empty(3, np.int64)
    for a in range(3):
        first[a] = max(low[a] - around, 0) >> shift
        last[a] = min((high[a] + around) >> shift, cubes.shape[2 - a] - 1)
    nz, ny, nx = distance.shape
    for c in range(first[2], last[2] + 1):
        k0, k1 = max(c * side - around, 0), min((c + 1) * side + around, nz)
        for b in range(first[1], last[1] + 1):
            j0, j1 = max(b * side - around, 0), min((b + 1) * side + around, ny)
            for a in range(first[0], last[0] + 1):
                i0, i1 = max(a * side - around, 0), min((a + 1) * side + around, nx)
                found = 0
                for k in range(k0, k1):
                    for j in range(j0, j1):
                        for i in range(i0, i1):
                            d = distance[k, j, i]
                            cut = pristine[k, j, i] - d > f32(LEAST_DEPTH_MM)
                            if cut and abs(d) < near:
                                found |= CUT
                            if film[k, j, i] > 0:
                                found |= WET
                cubes[c, b, a] = found
