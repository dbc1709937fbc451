"""Splats projected for one view, sixteen at a time.

Projection is the affine map at the splat's centre (Zwicker et al., EWA splatting, IEEE
TVCG 2002), for three lens laws.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.depth_sort import NOWHERE
from renderers.fsr.splats.gaussian_falloff import SCALE, WEIGHT
from renderers.fsr.splats.peak_opacity import DEEPEST, PEAK
from renderers.fsr.splats.splat_tiles import TILE_SHIFT
from renderers.lanes import (
    absolute,
    as_f32,
    as_i32,
    copy_rows4,
    count,
    floor,
    full,
    i32,
    lanes,
    load,
    maximum,
    minimum,
    prefetch,
    put_rows4,
    rows4,
    select,
    sqrt,
    store,
    store_quads,
)

RECORD = 16
"""Floats of a projected splat, a line of the cache: pixel centre 0-1, what a squared
distance over the cut's, times `SCALE`, is made of, xx, xy, yy 2-4 (for a point, half
its side in place of the first), peak times `WEIGHT` 5 (a point's peak), depth 6,
colour 8-10. The others are not used. A splat's box of pixels is kept apart: it is all
that is asked of splats which no light reaches."""
ANTIALIAS = 0.3
"""Squared pixels added to a footprint's covariance, so that small ones keep mass."""
CUT = 3.0
"""Sigmas at which a footprint ends."""
CUT_SHARE = SCALE / np.float32(CUT**2)
"""Makes `SCALE` times a squared distance over the cut's of one in sigmas."""
OPAQUEST = 1.0 - 1e-6
OVERLAP = 1e-4
"""Pixels added to half a point's side: rounding must not open gaps between them."""
LOG2E = np.float32(1 / math.log(2))
# 2^x on -0.5..0.5
POWER = tuple(np.float32(math.log(2) ** k / math.factorial(k)) for k in range(1, 7))
# Abramowitz and Stegun 4.4.49: arctan(x) / x on 0..1, error below 2e-8.
ATAN = (
    np.float32(-0.3333314528), np.float32(0.1999355085), np.float32(-0.1420889944),
    np.float32(0.1065626393), np.float32(-0.0752896400), np.float32(0.0429096138),
    np.float32(-0.0161657367), np.float32(0.0028662257),
)  # fmt: skip
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
Real = float | np.float32
_W = 16
_AHEAD = 6 * _W
_LINE = 4
"""Splats in a line of the cache: neighbours mostly follow one another."""
_ONE = np.float32(1)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def polar_angle(rho: Any, z: Any) -> Any:
    """Give atan2(rho, z) in 0..pi for rho >= 0."""
    size = absolute(z)
    x = minimum(rho, size) / maximum(maximum(rho, size), np.float32(1e-30))
    s = x * x
    p = s * ATAN[7] + ATAN[6]
    p = p * s + ATAN[5]
    p = p * s + ATAN[4]
    p = p * s + ATAN[3]
    p = p * s + ATAN[2]
    p = p * s + ATAN[1]
    p = p * s + ATAN[0]
    a = p * s * x + x
    a = select(rho > size, np.float32(0.5 * math.pi) - a, a)
    return select(z < _ZERO, np.float32(math.pi) - a, a)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def absorbed(depth: Any) -> Any:
    """Give 1 - exp(-depth) for optical depths >= 0."""
    p = depth * np.float32(-1 / 720) + np.float32(1 / 120)
    p = p * depth - np.float32(1 / 24)
    p = p * depth + np.float32(1 / 6)
    p = p * depth - _HALF
    thin = depth * (p * depth + _ONE)
    y = maximum(-depth * LOG2E, np.float32(-126))
    n = floor(y + _HALF)
    f = y - n
    p = f * POWER[5] + POWER[4]
    p = p * f + POWER[3]
    p = p * f + POWER[2]
    p = p * f + POWER[1]
    p = p * f + POWER[0]
    p = p * f + _ONE
    rest = p * as_f32((i32(n) + 127) << 23)
    return select(depth < np.float32(0.25), thin, _ONE - rest)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def peak_of(depth: Any) -> Any:
    """Give the peak for an optical depth, see `renderers.fsr.splats.peak_opacity`."""
    t = minimum(depth, DEEPEST)
    p = t * PEAK[5] + PEAK[4]
    p = p * t + PEAK[3]
    p = p * t + PEAK[2]
    p = p * t + PEAK[1]
    p = p * t + PEAK[0]
    return p * t


@njit(cache=True, nogil=True, error_model="numpy")
def project_splats(
    index: I32, n: int, places: F32, paints: F32, base: F32, matrix: F32, sigma: Real,
    projection: int, scale: Real, width: int, height: int, widest: Real,
    sized: bool, points: bool, sheet_share: Real, records: F32, boxes: I32, ranges: I32,
) -> int:  # fmt: skip
    """Write records of the first n splats; give the number of those that may show.

    index: says which. base: a grid point near the eye, from which places are counted.
    matrix: ``(3, 4)``, camera frame from grid steps away from it. sigma: of a footprint
    of size one, in grid steps. scale: pixels per radian, tangent or mm. widest: splats
    of a squared angular sigma above this are left out; orthographic ones never are.
    sized: not all are of size one. points: squares of constant opacity. sheet_share:
    not zero in sheets, where a peak is an optical depth: the footprint's sum over sigma
    squared. boxes: ``(n, 4)`` first and last column of a splat's pixels, sixteen bits
    each from the lowest, first and last row, the bits of the depth; one is not used.
    ranges: first and last tile column and row, a byte each from the lowest, `NOWHERE`
    for what does not show. index and what is written have sixteen to spare.
    """
    m = matrix
    s2 = sigma * sigma
    soften = np.float32(ANTIALIAS)
    cut = np.float32(CUT)
    right = np.float32(width)
    bottom = np.float32(height)
    half_width = np.float32(0.5 * width)
    half_height = np.float32(0.5 * height)
    per_variance = _ONE / s2
    per_sheet = _ONE / sheet_share if sheet_share > _ZERO else _ZERO
    visible = 0
    for e in range(0, n, _W):
        met = lanes(_W) < n - e
        for lane in range(0, _W, _LINE):
            soon = index[min(e + _AHEAD + lane, n - 1)] * 4
            prefetch(places, soon)
            prefetch(paints, soon)
        s = select(met, load(index, e, _W), np.int32(0))
        dx, dy, dz, mass = rows4(places, s)
        dx -= base[0]
        dy -= base[1]
        dz -= base[2]
        x = dx * m[0, 0] + dy * m[0, 1] + dz * m[0, 2] + m[0, 3]
        y = dx * m[1, 0] + dy * m[1, 1] + dz * m[1, 2] + m[1, 3]
        z = dx * m[2, 0] + dy * m[2, 1] + dz * m[2, 2] + m[2, 3]
        rho2 = x * x + y * y
        d2 = rho2 + z * z
        distance = sqrt(d2)
        if projection == 0:
            rho = sqrt(rho2)
            off_axis = rho > np.float32(1e-6)
            inverse = select(off_axis, _ONE / rho, _ZERO)
            cx = select(off_axis, x * inverse, _ONE)
            cy = y * inverse
            shrink = scale / d2
            r = polar_angle(rho, z) * scale
            rr = z * shrink
            rz = -rho * shrink
            tt = select(off_axis, r * inverse, shrink * distance)
            area = shrink * distance * tt
            u = r * cx + half_width
            v = half_height - r * cy
            cross = cx * cy
            a0 = cx * cx * rr + cy * cy * tt
            a1 = cross * (rr - tt)
            a2 = cx * rz
            b1 = -(cy * cy * rr + cx * cx * tt)
            b2 = -(cy * rz)
            share = full(s2, _W)
        else:
            if projection == 1:
                met &= z > distance * np.float32(1e-3)
                inverse = _ONE / z
                lens = inverse * scale
                a2 = -(x * inverse)
                b2 = y * inverse
                u = half_width - a2 * scale
                v = half_height - b2 * scale
                area = lens * lens
                share = area * s2
                area = area * distance * inverse
            else:
                a2 = full(_ZERO, _W)
                b2 = a2
                u = x * scale + half_width
                v = half_height - y * scale
                area = full(scale * scale, _W)
                share = area * s2
        xx = full(_ZERO, _W)
        xy = full(_ZERO, _W)
        yy = full(_ZERO, _W)
        for c in range(3):
            if projection == 0:
                p = a0 * m[0, c] + a1 * m[1, c] + a2 * m[2, c]
                q = b1 * m[1, c] + b2 * m[2, c] - a1 * m[0, c]
            else:
                p = a2 * m[2, c] + m[0, c]
                q = b2 * m[2, c] - m[1, c]
            xx += p * p
            xy += p * q
            yy += q * q
        if sized:
            _, _, _, size = rows4(paints, s)
            share = share * (size * size)
        if projection != 2:
            bound = d2 * area * widest
            before = share * share * (xx * yy - xy * xy)
            met &= before <= bound * bound
        xx = xx * share
        yy = yy * share
        xy = xy * share
        tau = mass * area
        if points:
            cell = sqrt(maximum(xx * yy - xy * xy, np.float32(1e-30))) * per_variance
            side = maximum(sqrt(cell), _ONE) * _HALF + np.float32(OVERLAP)
            peak = minimum(
                absorbed(tau / (side * side * np.float32(4))), np.float32(OPAQUEST)
            )
            wide = side
            high = side
            curve = side
            skew = side
            bend = side
            gain = peak
        else:
            xx += soften
            yy += soften
            inverse = _ONE / sqrt(xx * yy - xy * xy)
            tau = tau * inverse
            wide = sqrt(xx) * cut
            high = sqrt(yy) * cut
            inverse = inverse * inverse * CUT_SHARE
            curve = yy * inverse
            skew = xy * inverse * np.float32(-2)
            bend = xx * inverse
            if sheet_share > _ZERO:
                peak = tau * per_sheet
            else:
                peak = minimum(peak_of(tau * s2), np.float32(OPAQUEST))
            gain = peak * WEIGHT
        x0 = minimum(maximum(-floor(wide - u + _HALF), _ZERO), right)
        x1 = maximum(minimum(floor(u + wide - _HALF), right - _ONE), -_ONE)
        y0 = minimum(maximum(-floor(high - v + _HALF), _ZERO), bottom)
        y1 = maximum(minimum(floor(v + high - _HALF), bottom - _ONE), -_ONE)
        met &= (x0 <= x1) & (y0 <= y1) & (peak > _ZERO)
        first, end, upper, lower = i32(x0), i32(x1), i32(y0), i32(y1)
        tiles = (first >> TILE_SHIFT) | ((end >> TILE_SHIFT) << 8)
        tiles |= ((upper >> TILE_SHIFT) << 16) | ((lower >> TILE_SHIFT) << 24)
        store(ranges, e, select(met, tiles, np.int32(NOWHERE)))
        depth = z if projection == 2 else distance
        row = lanes(_W) + np.int32(e)
        far = as_i32(depth)
        columns = first | (end << 16)
        store_quads(boxes, 4 * e, 16, columns, upper | (lower << 16), far, far)
        row = row * (RECORD // 4)
        put_rows4(records, row, u, v, curve, skew)
        put_rows4(records, row + 1, bend, gain, depth, depth)
        copy_rows4(records, row + 2, paints, s)
        visible += count(met)
    return visible
