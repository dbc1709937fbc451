"""Compiled: where the pixels of a block that show pushed tissue lie at rest.

Noise, tint, layers and blood belong to tissue, which keeps them when it is pushed.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

import renderers.shading.kernels.pixel_block as block
from renderers.shading.kernels.elementary import load3, rotated
from renderers.shading.kernels.field_reads import taps
from renderers.shading.kernels.pixel_block import N, W
from renderers.simd import any_, load, store
from renderers.simd.arrays import Floats, f32


class PushedField(NamedTuple):
    """Where shown tissue lies at rest; empty where nobody pushes.

    x, y, z: ``(nz, ny, nx)`` mm from where it is shown, along the world's axes. box:
    ``(6,)`` low and high voxel coordinates beyond which they are 0.
    """

    x: Floats
    y: Floats
    z: Floats
    box: Floats


@njit(cache=True, nogil=True, error_model="numpy")
def bring_to_rest(w: Floats, pushed: PushedField, to_voxel: Floats) -> bool:
    """Move a block's points to where they lie at rest; say if there are such points.

    Where they are shown is kept for `show_again`. to_voxel: ``(3, 3)``, mm to voxels.
    """
    box = pushed.box
    if not box[3] > box[0]:
        return False
    x, y, z = load3(w, block.UX)
    near = (load(w, block.COVER, N) > f32(0)) & (x > box[0]) & (x < box[3])
    near &= (y > box[1]) & (y < box[4]) & (z > box[2]) & (z < box[5])
    if not any_(near):
        return False
    for i in range(0, 6 * N, W):
        store(w, block.SHOWN + i, load(w, block.PX + i, W))
    for i in range(0, N, W):
        x = load(w, block.UX + i, W)
        y = load(w, block.UY + i, W)
        z = load(w, block.UZ + i, W)
        dx = taps(pushed.x, x, y, z)
        dy = taps(pushed.y, x, y, z)
        dz = taps(pushed.z, x, y, z)
        store(w, block.PX + i, load(w, block.PX + i, W) + dx)
        store(w, block.PY + i, load(w, block.PY + i, W) + dy)
        store(w, block.PZ + i, load(w, block.PZ + i, W) + dz)
        u, v, t = rotated(to_voxel, dx, dy, dz)
        store(w, block.UX + i, x + u)
        store(w, block.UY + i, y + v)
        store(w, block.UZ + i, z + t)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def show_again(w: Floats) -> None:
    """Move a block's points back to where they are shown."""
    for i in range(0, 6 * N, W):
        store(w, block.PX + i, load(w, block.SHOWN + i, W))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def voxel_at_rest(
    pushed: PushedField, to_voxel: Floats, i: int, j: int, k: int
) -> tuple[int, int, int]:
    """Return the voxel (i, j, k) at which lies what is shown at another one."""
    dx, dy, dz = pushed.x[k, j, i], pushed.y[k, j, i], pushed.z[k, j, i]
    u, v, t = rotated(to_voxel, dx, dy, dz)
    nz, ny, nx = pushed.x.shape
    return (
        min(max(int(np.rint(i + u)), 0), nx - 1),
        min(max(int(np.rint(j + v)), 0), ny - 1),
        min(max(int(np.rint(k + t)), 0), nz - 1),
    )
