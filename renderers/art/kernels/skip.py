"""Where packets of rays stand, and how far they leap over what is empty.

Every cube between eight voxels has a Chebyshev distance, in cubes, to the next one with
something in it: cubes nearer than that are empty. A ray leaps to the last sample that
surely lies within them.
"""

from typing import Any

import numpy as np
from numba import njit

from renderers.art.kernels.opacity import HALF, ONE, ZERO
from renderers.lanes import absolute, f32, i32, maximum, minimum, select

Lanes = Any
"""A vector of `renderers.lanes`."""

SLOWEST = np.float32(1e-6)
"""Voxels a sample; keeps reciprocals finite."""

WITHIN = np.float32(0.501)
"""Leaps end so much before empty space does, counted from a cube's middle. Positions
are good to 6e-5 voxel at 1024 voxels, so no rounding can leap over a sample that
counts."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def per_voxel(s: Lanes) -> Lanes:
    """Turn voxels per sample into samples per voxel, finite also across the axis."""
    # Faster than it is, towards the same side: leaps only become shorter.
    return ONE / select(s >= ZERO, maximum(s, SLOWEST), minimum(s, -SLOWEST))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def stand(
    at: Lanes, ox: Lanes, oy: Lanes, oz: Lanes, sx: Lanes, sy: Lanes, sz: Lanes,
    top_x: np.int32, top_y: np.int32, top_z: np.int32,
) -> tuple[Lanes, Lanes, Lanes, Lanes, Lanes, Lanes]:  # fmt: skip
    """Give the cubes that samples `at` of rays lie in, and how far in: x, y, z each."""
    x, y, z = ox + at * sx, oy + at * sy, oz + at * sz
    # The last sample lies on the volume's face, and rounding beyond it.
    ix, iy, iz = minimum(i32(x), top_x), minimum(i32(y), top_y), minimum(i32(z), top_z)
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
    leaps: Lanes, far: Lanes, fx: Lanes, fy: Lanes, fz: Lanes,
    px: Lanes, py: Lanes, pz: Lanes, left: Lanes,
) -> Lanes:  # fmt: skip
    """Count the samples that surely lie in empty space, this one among them.

    leaps: for whom; 0 elsewhere. far: cubes nearer than that are empty. fx, fy, fz: of
    `stand`. px, py, pz: samples per voxel. left: samples to the ray's end.
    """
    reach = f32(far) - WITHIN
    out = _way_out(fx, px, reach)
    out = minimum(out, _way_out(fy, py, reach))
    out = minimum(out, _way_out(fz, pz, reach))
    out = minimum(maximum(out, ZERO), f32(left - 1))
    return select(leaps, i32(out) + 1, 0)
