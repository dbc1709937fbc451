"""Place the samples of packets of rays, and leap over what is empty.

Every cube between eight voxels has a Chebyshev distance, in cubes, to the next one with
something in it: cubes nearer than that are empty. A ray leaps to the last sample that
surely lies within them.
"""

import numpy as np
from numba import njit

from renderers.art.kernels.march_types import ABSENT, I32, Lanes, Line, Three
from renderers.art.kernels.opacity import HALF, ONE, ZERO
from renderers.simd import absolute, f32, gather, i32, maximum, minimum, select

SLOWEST = np.float32(1e-6)
"""Voxels a sample; keeps reciprocals finite."""

WITHIN = np.float32(0.501)
"""Leaps end so much before empty space does, counted from a cube's middle. Positions
are good to 6e-5 voxel at 1024 voxels, so no rounding can leap over a sample that
counts."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def rows_of(
    top: I32, shift: int, whole: bool
) -> tuple[np.int32, np.int32, np.int32, np.int32]:
    """Return numbers from voxel to voxel along y and z, and from cube to cube.

    Voxels of a brick, or of the volume; cubes of the volume. top: of `CellView`.
    """
    n1 = np.int32((1 << shift) + 1)
    n2 = np.int32(n1 * n1)
    if whole:
        n1, n2 = top[0] + np.int32(2), top[1] + np.int32(2)
        n2 *= n1
    row, slab = top[0] + np.int32(1), (top[0] + np.int32(1)) * (top[1] + np.int32(1))
    return n1, n2, row, slab


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _per_voxel(s: Lanes) -> Lanes:
    # Faster than it is, towards the same side: leaps only become shorter.
    return ONE / select(s >= ZERO, maximum(s, SLOWEST), minimum(s, -SLOWEST))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def per_voxel(x: Lanes, y: Lanes, z: Lanes) -> Three:
    """Turn voxels per sample into samples per voxel, finite also across an axis."""
    return _per_voxel(x), _per_voxel(y), _per_voxel(z)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def place_samples(at: Lanes, line: Line, top: Three) -> Line:
    """Return the cubes that samples `at` of rays lie in, and how far in.

    line: origins and steps. top: the last cubes along x, y and z.
    """
    ox, oy, oz, sx, sy, sz = line
    x, y, z = ox + at * sx, oy + at * sy, oz + at * sz
    # The last sample lies on the volume's face, and rounding beyond it.
    ix, iy, iz = (
        minimum(i32(x), top[0]),
        minimum(i32(y), top[1]),
        minimum(i32(z), top[2]),
    )
    return ix, iy, iz, x - f32(ix), y - f32(iy), z - f32(iz)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _way_out(f: Lanes, p: Lanes, reach: Lanes) -> Lanes:
    """Count samples along one axis out of the empty cubes around.

    f: how far into its cube a sample is. p: samples per voxel. reach: from the middle
    of the cube to where leaps along the axis end.
    """
    return (HALF - f) * p + reach * absolute(p)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def leap(
    leaps: Lanes, far: Lanes, fx: Lanes, fy: Lanes, fz: Lanes, per: Three, left: Lanes
) -> Lanes:
    """Count the samples that surely lie in empty space, this one among them.

    leaps: for whom; 0 elsewhere. far: cubes nearer than that are empty. fx, fy, fz: how
    far into their cubes samples are. per: samples per voxel. left: to the ray's end.
    """
    reach = f32(far) - WITHIN
    out = _way_out(fx, per[0], reach)
    out = minimum(out, _way_out(fy, per[1], reach))
    out = minimum(out, _way_out(fz, per[2], reach))
    out = minimum(maximum(out, ZERO), f32(left - 1))
    return select(leaps, i32(out) + 1, 0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def find_corners(
    corners: I32, grid: tuple[Lanes, ...], whole: bool, ix: Lanes,
    iy: Lanes, iz: Lanes, at: Lanes,
) -> tuple[Lanes, Lanes, Lanes]:  # fmt: skip
    """Return cubes' cells, their lowest corners among the samples, and what is missing.

    grid: shift from voxels to cells, cells along x and y, rows of `rows_of`. whole: all
    samples are in a row, and no cell is looked up.
    """
    shift, cells_x, cells_y, n1, n2 = grid
    corner = iz * n2 + iy * n1 + ix
    if whole:
        return corner, corner, corner < corner
    cell = (iz >> shift) * cells_y + (iy >> shift)
    cell = select(at, cell * cells_x + (ix >> shift), 0)
    first = gather(corners, cell, at)
    return cell, corner + first, at & (first == ABSENT)
