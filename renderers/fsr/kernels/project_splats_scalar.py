"""Splats of mode `classic`, projected for one view.

Projection is the affine map at the splat's centre (Zwicker et al., EWA splatting,
IEEE TVCG 2002), for three lens laws.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.depth_sort_scalar import NOWHERE
from renderers.fsr.splats.gaussian_falloff import SCALE, WEIGHT
from renderers.fsr.splats.peak_opacity import DEEPEST, PEAK
from renderers.fsr.splats.splat_tiles import TILE_SHIFT

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
Real = float | np.float32

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

_ONE = np.float32(1)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)
LOG2E = np.float32(1 / math.log(2))

# 2^x on -0.5..0.5
POWER = tuple(np.float32(math.log(2) ** k / math.factorial(k)) for k in range(1, 7))

# Abramowitz and Stegun 4.4.49: arctan(x) / x on 0..1, error below 2e-8.
ATAN = (
    np.float32(-0.3333314528), np.float32(0.1999355085), np.float32(-0.1420889944),
    np.float32(0.1065626393), np.float32(-0.0752896400), np.float32(0.0429096138),
    np.float32(-0.0161657367), np.float32(0.0028662257),
)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def polar_angle(rho: Any, z: Any) -> Any:
    """Give atan2(rho, z) in 0..pi for rho >= 0, float32."""
    size = abs(z)
    x = min(rho, size) / max(max(rho, size), np.float32(1e-30))
    s = x * x
    p = s * ATAN[7] + ATAN[6]
    p = p * s + ATAN[5]
    p = p * s + ATAN[4]
    p = p * s + ATAN[3]
    p = p * s + ATAN[2]
    p = p * s + ATAN[1]
    p = p * s + ATAN[0]
    a = p * s * x + x
    if rho > size:
        a = np.float32(0.5 * math.pi) - a
    return np.float32(math.pi) - a if z < _ZERO else a


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def absorbed(depth: Real) -> Any:
    """Give 1 - exp(-depth) for an optical depth >= 0, float32."""
    if depth < np.float32(0.25):
        p = depth * np.float32(-1 / 720) + np.float32(1 / 120)
        p = p * depth - np.float32(1 / 24)
        p = p * depth + np.float32(1 / 6)
        p = p * depth - _HALF
        return depth * (p * depth + _ONE)
    y = max(-depth * LOG2E, np.float32(-126))
    n = math.floor(y + _HALF)
    f = y - np.float32(n)
    p = f * POWER[5] + POWER[4]
    p = p * f + POWER[3]
    p = p * f + POWER[2]
    p = p * f + POWER[1]
    p = p * f + POWER[0]
    p = p * f + _ONE
    return _ONE - np.float32(math.ldexp(p, n))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def peak_of(depth: Any) -> Any:
    """Give the peak for an optical depth, see `renderers.fsr.splats.peak_opacity`."""
    t = min(depth, DEEPEST)
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

    index: says which. base: a grid point near the eye, from which places
    are counted. matrix: ``(3, 4)``, camera frame from grid steps away from it.
    sigma: of a footprint of size one, in grid steps. scale: pixels per radian,
    tangent or mm. widest: splats of a squared angular sigma above this are left out;
    orthographic ones never are. sized: not all are of size one. points: squares of
    constant opacity. sheet_share: not zero in sheets, where a peak is an optical
    depth: the footprint's sum over sigma squared. boxes: ``(n, 4)`` first and last
    column of a splat's pixels, sixteen bits each from the lowest, first and last row,
    the bits of the depth; one is not used. ranges: first and last tile column and row,
    a byte each from the lowest, `NOWHERE` for what does not show.
    """
    m = matrix
    s2 = sigma * sigma
    soften = np.float32(ANTIALIAS)
    half_width = np.float32(0.5 * width)
    half_height = np.float32(0.5 * height)
    per_variance = _ONE / s2
    per_sheet = _ONE / sheet_share if sheet_share > _ZERO else _ZERO
    visible = 0
    for e in range(n):
        s = index[e]
        ranges[e] = NOWHERE
        dx = places[s, 0] - base[0]
        dy = places[s, 1] - base[1]
        dz = places[s, 2] - base[2]
        x = dx * m[0, 0] + dy * m[0, 1] + dz * m[0, 2] + m[0, 3]
        y = dx * m[1, 0] + dy * m[1, 1] + dz * m[1, 2] + m[1, 3]
        z = dx * m[2, 0] + dy * m[2, 1] + dz * m[2, 2] + m[2, 3]
        rho2 = x * x + y * y
        d2 = rho2 + z * z
        distance = np.float32(math.sqrt(d2))
        if projection == 0:
            rho = np.float32(math.sqrt(rho2))
            off_axis = rho > np.float32(1e-6)
            inverse = _ONE / rho if off_axis else _ZERO
            cx = x * inverse if off_axis else _ONE
            cy = y * inverse
            shrink = scale / d2
            r = polar_angle(rho, z) * scale
            rr = z * shrink
            rz = -rho * shrink
            tt = r * inverse if off_axis else shrink * distance
            area: Any = shrink * distance * tt
            u = r * cx + half_width
            v = half_height - r * cy
            cross = cx * cy
            a0 = cx * cx * rr + cy * cy * tt
            a1 = cross * (rr - tt)
            a2 = cx * rz
            b1 = -(cy * cy * rr + cx * cx * tt)
            b2 = -(cy * rz)
            share: Any = s2
        elif projection == 1:
            if not z > distance * np.float32(1e-3):
                continue
            # rows of the map over pixels per mm: (1, 0, a2), (0, -1, b2)
            inverse = _ONE / z
            lens = inverse * scale
            a2 = -(x * inverse)
            b2 = y * inverse
            u = half_width - a2 * scale
            v = half_height - b2 * scale
            area = lens * lens
            share = area * s2
            # seen along the oblique ray, radially stretched by 1 / cos^2
            area = area * distance * inverse
        else:
            a2 = _ZERO
            b2 = _ZERO
            u = x * scale + half_width
            v = half_height - y * scale
            area = scale * scale
            share = area * s2
        xx = _ZERO
        xy = _ZERO
        yy = _ZERO
        for c in range(3):
            if projection == 0:
                p = a0 * m[0, c] + a1 * m[1, c] + a2 * m[2, c]
                q = b1 * m[1, c] + b2 * m[2, c] - a1 * m[0, c]
            else:
                p = a2 * m[2, c] + m[0, c]
                q = b2 * m[2, c] - m[1, c]
            xx = xx + p * p
            xy = xy + p * q
            yy = yy + q * q
        if sized:
            share = share * (paints[s, 3] * paints[s, 3])
        if projection != 2:
            # squares of areas: of the footprint, and of the widest at its distance
            bound = d2 * area * widest
            before = share * share * (xx * yy - xy * xy)
            if not before <= bound * bound:
                continue
        xx = xx * share
        yy = yy * share
        xy = xy * share
        # optical depth times pixels
        tau = places[s, 3] * area
        peak: Any
        if points:
            # pixels of one projected voxel; a lattice has this area per splat
            cell = np.float32(math.sqrt(max(xx * yy - xy * xy, np.float32(1e-30))))
            cell = cell * per_variance
            side = max(np.float32(math.sqrt(cell)), _ONE) * _HALF + np.float32(OVERLAP)
            peak = absorbed(tau / (side * side * np.float32(4)))
            peak = min(peak, np.float32(OPAQUEST))
            wide = side
            high = side
            curve = side
            skew = side
            bend = side
            gain = peak
        else:
            xx = xx + soften
            yy = yy + soften
            inverse = _ONE / np.float32(math.sqrt(xx * yy - xy * xy))
            tau = tau * inverse
            wide = np.float32(math.sqrt(xx)) * np.float32(CUT)
            high = np.float32(math.sqrt(yy)) * np.float32(CUT)
            inverse = inverse * inverse * CUT_SHARE
            curve = yy * inverse
            skew = xy * inverse * np.float32(-2)
            bend = xx * inverse
            if sheet_share > _ZERO:
                peak = tau * per_sheet
            else:
                peak = min(peak_of(tau * s2), np.float32(OPAQUEST))
            gain = peak * WEIGHT
        # bounded before they become integers; ceil(a) is -floor(-a)
        x0 = min(max(-np.floor(wide - u + _HALF), _ZERO), np.float32(width))
        x1 = max(min(np.floor(u + wide - _HALF), np.float32(width - 1)), -_ONE)
        y0 = min(max(-np.floor(high - v + _HALF), _ZERO), np.float32(height))
        y1 = max(min(np.floor(v + high - _HALF), np.float32(height - 1)), -_ONE)
        if not (x0 <= x1 and y0 <= y1 and peak > _ZERO):
            continue
        left, right, top_, bottom = int(x0), int(x1), int(y0), int(y1)
        across = left >> TILE_SHIFT | right >> TILE_SHIFT << 8
        down = top_ >> TILE_SHIFT | bottom >> TILE_SHIFT << 8
        ranges[e] = np.int32(across | down << 16)
        record = records[e]
        record[0] = u
        record[1] = v
        record[2] = curve
        record[3] = skew
        record[4] = bend
        record[5] = gain
        record[6] = z if projection == 2 else distance
        boxes[e, 0] = left | right << 16
        boxes[e, 1] = top_ | bottom << 16
        boxes[e, 2] = np.float32(record[6]).view(np.int32)
        record[8] = paints[s, 0]
        record[9] = paints[s, 1]
        record[10] = paints[s, 2]
        visible += 1
    return visible
