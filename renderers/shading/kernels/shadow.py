"""Compiled: what capsules take of the light that comes to a block of pixels.

Positions are millimetres from the eye along world axes. A row of `capsules` is laid out
as `capsules.COLUMNS` says.
"""

import math

from numba import njit

import renderers.shading.kernels.pixel_block as block
from renderers.shading.kernels.elementary import load3
from renderers.shading.kernels.field_reads import Place
from renderers.shading.kernels.pixel_block import N
from renderers.simd import any_, full, load, maximum, minimum, sqrt, store
from renderers.simd.arrays import Floats, Lanes, f32

BUNDLE_RADIUS_MM = 0.225
"""Of a fibre bundle's end: no shadow is sharper."""
BUNDLE2 = f32(0.75 * BUNDLE_RADIUS_MM**2)
"""Square of half the width of a line that spreads as such a disc does."""
FAR = f32(1e6)
LEAST = f32(1e-3)
"""mm; keeps quotients finite where a point touches the capsule."""


@njit(cache=True, nogil=True, error_model="numpy")
def shadow(w: Floats, source: Place, arc: Place, capsules: Floats) -> None:
    """Take from a source's intensity what capsules hide of it.

    arc: half the line of fibre ends that the source stands for. Of a line of light
    seen across a capsule, the part hidden is the overlap of two intervals: exact where
    the line is straight and the capsule long, and right from contact (sharp) to far
    behind a thin capsule (faint). Where several hide something the most counts.
    """
    px, py, pz = load3(w, block.PX)
    lx, ly, lz = load3(w, block.LX)
    ux, uy, uz = arc
    # half the light's width, seen across a capsule at most
    widest = f32(math.sqrt(ux * ux + uy * uy + uz * uz + BUNDLE2))
    # from the point to the source
    way = (source[0] - px) * lx + (source[1] - py) * ly + (source[2] - pz) * lz
    inverse = f32(1) / (way + LEAST)
    most = full(f32(0), N)
    for r in range(capsules.shape[0]):
        ax, ay, az = capsules[r, 3], capsules[r, 4], capsules[r, 5]
        length, radius = capsules[r, 6], capsules[r, 7]
        low = -FAR if capsules[r, 8] > f32(0) else f32(0)
        high = FAR if capsules[r, 9] > f32(0) else length
        wx = px - capsules[r, 0]
        wy = py - capsules[r, 1]
        wz = pz - capsules[r, 2]
        # where ray and axis are nearest: t along the ray, s along the axis
        b = lx * ax + ly * ay + lz * az
        e = wx * ax + wy * ay + wz * az
        g = wx * lx + wy * ly + wz * lz
        t = (b * e - g) / maximum(f32(1) - b * b, f32(1e-4))
        t = minimum(maximum(t, f32(0)), way)
        s = e + b * t
        held = minimum(maximum(s, low), high)
        t = minimum(maximum(b * held - g, f32(0)), way)
        qx = wx + t * lx - held * ax
        qy = wy + t * ly - held * ay
        qz = wz + t * lz - held * az
        q2 = qx * qx + qy * qy + qz * qz + f32(1e-9)
        share = t * inverse
        # a little more than the widest shadow there: most blocks are lit by all
        reach = f32(1.001) * (radius + widest * share + LEAST)
        if not any_(q2 < reach * reach):
            continue
        q = sqrt(q2)
        # half the light's width there, across the capsule and along it
        across = (qx * ux + qy * uy + qz * uz) / q
        across = sqrt(across * across + BUNDLE2) * share + LEAST
        hidden = minimum(q + across, radius) - maximum(q - across, -radius)
        hidden = maximum(hidden, f32(0)) / across
        along = ax * ux + ay * uy + az * uz
        along = f32(math.sqrt(along * along + BUNDLE2)) * share + LEAST
        over = full(-FAR, N)
        if capsules[r, 8] > f32(0):
            over = -s
        if capsules[r, 9] > f32(0):
            over = maximum(over, s - length)
        within = f32(0.5) - f32(0.5) * over / along
        within = minimum(maximum(within, f32(0)), f32(1))
        # a capsule does not hide the light from the side that faces it
        beyond = minimum(t * (f32(2) / radius), f32(1))
        most = maximum(most, f32(0.5) * hidden * within * beyond)
    store(w, block.POWER, load(w, block.POWER, N) * (f32(1) - minimum(most, f32(1))))


@njit(cache=True, nogil=True, error_model="numpy")
def spread_share(u: Lanes) -> Lanes:
    """Return the integral of cos^2 from 0 to asin(u) over its largest value.

    (asin u + u sqrt(1 - u^2)) / (pi / 2), by an odd cubic; off by .018 at most.
    """
    return u * (f32(4 / math.pi) - f32(4 / math.pi - 1) * (u * u))


@njit(cache=True, nogil=True, error_model="numpy")
def darken(w: Floats, capsules: Floats) -> None:
    """Take from the bounced light what capsules hide of the surroundings.

    The share hidden is the view factor from a small patch to a capsule: radius over
    distance times the cosine for an endless one (Hamilton, Morgan, NACA TN 2836, 1952),
    that of a strip of its width for an end. What the capsule itself sends back is left.
    """
    px, py, pz = load3(w, block.PX)
    nx, ny, nz = load3(w, block.NX)
    left = full(f32(1), N)
    for r in range(capsules.shape[0]):
        ax, ay, az = capsules[r, 3], capsules[r, 4], capsules[r, 5]
        wx = capsules[r, 0] - px
        wy = capsules[r, 1] - py
        wz = capsules[r, 2] - pz
        s = wx * ax + wy * ay + wz * az
        # the foot of the axis, and where the capsule's ends are seen from it
        wx -= s * ax
        wy -= s * ay
        wz -= s * az
        d2 = maximum(wx * wx + wy * wy + wz * wz, f32(1e-4))
        k = f32(1) / sqrt(d2)
        end = s + capsules[r, 6]
        near = f32(1) / (d2 + s * s)
        far = f32(1) / (d2 + end * end)
        facing = nx * wx + ny * wy + nz * wz
        along = nx * ax + ny * ay + nz * az
        middle = spread_share(end * sqrt(far)) - spread_share(s * sqrt(near))
        share = f32(0.5) * facing * k * middle
        share += f32(1 / math.pi) * along * d2 * (near - far)
        share *= capsules[r, 7] * k
        share = minimum(maximum(share, f32(0)), f32(1))
        left *= f32(1) - share * capsules[r, 10]
    store(w, block.BOUNCE, left * load(w, block.BOUNCE, N))
