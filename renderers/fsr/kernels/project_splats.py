"""Splats projected for one view, sixteen at a time.

Projection is the affine map at the splat's centre (Zwicker et al., EWA splatting, IEEE
TVCG 2002), for three lens laws.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, I64, Lanes
from renderers.fsr.kernels.depth_sort import NOWHERE
from renderers.fsr.kernels.footprint import (
    ANTIALIAS,
    CUT,
    CUT_SHARE,
    WEIGHT,
    absorbed,
    peak_of,
)
from renderers.fsr.kernels.tile_buffer import TILE_SHIFT
from renderers.fsr.kernels.view_planes import (
    EQUIDISTANT,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    GridView,
)
from renderers.simd import (
    absolute,
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
that is read of splats which no light reaches."""
OPAQUEST = 1.0 - 1e-6
OVERLAP = 1e-4
"""Pixels added to half a point's side: rounding must not open gaps between them."""
# Abramowitz and Stegun 4.4.49: arctan(x) / x on 0..1, error below 2e-8.
ATAN = (
    np.float32(-0.3333314528), np.float32(0.1999355085), np.float32(-0.1420889944),
    np.float32(0.1065626393), np.float32(-0.0752896400), np.float32(0.0429096138),
    np.float32(-0.0161657367), np.float32(0.0028662257),
)  # fmt: skip
_W = 16
_AHEAD = 6 * _W
_LINE = 4
"""Splats in a line of the cache: neighbours mostly follow one another."""
_ONE = np.float32(1)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)


class Splats(NamedTuple):
    """Shaded splats.

    places: ``(n, 4)`` grid place (i, j, k) and extinction times volume (mm^2). colors:
    ``(n, 4)`` linear RGB, lit, and the size in grid steps.
    """

    places: F32
    colors: F32


class Style(NamedTuple):
    """How splats are drawn.

    sigma: of a footprint of size one, in grid steps. widest: squared angular sigma
    above which a splat is left out; orthographic ones never are. points: squares of
    constant opacity. reach_mm: radius of a splat.
    """

    sigma: np.float32
    widest: np.float32
    points: bool
    reach_mm: np.float32


class SplatBuffers(NamedTuple):
    """The splats of one depth slab while they are projected, sorted and drawn.

    numbers: ``(n,)`` which splats; keys: of their depths. records: ``(n, RECORD)``.
    boxes: ``(n, 4)`` first and last column of a splat's pixels, sixteen bits each from
    the lowest, first and last row, the bits of the depth; one is not used. ranges:
    ``(n,)`` first and last tile column and row, a byte each from the lowest, `NOWHERE`
    for what does not show. counts: ``(KEYS,)`` zeros between slabs. entries: see
    `place_by_keys`. items: ``(8, n)`` scratch. All have sixteen to spare.
    """

    numbers: I32
    keys: I32
    records: F32
    boxes: I32
    ranges: I32
    counts: I32
    entries: I64
    items: I32


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def polar_angle(rho: Lanes, z: Lanes) -> Lanes:
    """Return atan2(rho, z) in 0..pi for rho >= 0."""
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


@njit(cache=True, nogil=True, error_model="numpy")
def project_splats(
    index: I32, n: int, splats: Splats, sized: bool, view: GridView, style: Style,
    records: F32, boxes: I32, ranges: I32,
) -> int:  # fmt: skip
    """Write records of the first n splats; return the number of those that may show.

    index: says which. sized: not all are of size one. records, boxes, ranges: see
    `SplatBuffers`.
    """
    places, colors = splats
    base, m, projection, scale = view.base, view.matrix, view.projection, view.scale
    sigma, widest, points, _ = style
    s2 = sigma * sigma
    soften = np.float32(ANTIALIAS)
    cut = np.float32(CUT)
    right = np.float32(view.width)
    bottom = np.float32(view.height)
    half_width = np.float32(0.5 * view.width)
    half_height = np.float32(0.5 * view.height)
    per_variance = _ONE / s2
    visible = 0
    for e in range(0, n, _W):
        met = lanes(_W) < n - e
        for lane in range(0, _W, _LINE):
            soon = index[min(e + _AHEAD + lane, n - 1)] * 4
            prefetch(places, soon)
            prefetch(colors, soon)
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
        if projection == EQUIDISTANT:
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
        elif projection == PERSPECTIVE:
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
        xx = xy = yy = full(_ZERO, _W)
        for c in range(3):
            if projection == EQUIDISTANT:
                p = a0 * m[0, c] + a1 * m[1, c] + a2 * m[2, c]
                q = b1 * m[1, c] + b2 * m[2, c] - a1 * m[0, c]
            else:
                p = a2 * m[2, c] + m[0, c]
                q = b2 * m[2, c] - m[1, c]
            xx += p * p
            xy += p * q
            yy += q * q
        if sized:
            _, _, _, size = rows4(colors, s)
            share = share * (size * size)
        if projection != ORTHOGRAPHIC:
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
            wide = high = curve = skew = bend = side
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
        depth = z if projection == ORTHOGRAPHIC else distance
        row = lanes(_W) + np.int32(e)
        far = as_i32(depth)
        columns = first | (end << 16)
        store_quads(boxes, 4 * e, 16, columns, upper | (lower << 16), far, far)
        row = row * (RECORD // 4)
        put_rows4(records, row, u, v, curve, skew)
        put_rows4(records, row + 1, bend, gain, depth, depth)
        copy_rows4(records, row + 2, colors, s)
        visible += count(met)
    return visible
