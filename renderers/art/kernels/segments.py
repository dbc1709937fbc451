"""Integrate a transfer function along segments between two samples, lane by lane.

The density between two samples is a straight line. Extinction and colour are straight
lines in it between two of the user's nodes, so that the optical depth of a piece
without a node inside is its length times the mean of its ends, exactly. A segment
that crosses nodes is made of three pieces: up to its first node, between its first
and its last node (from sums over whole pieces), and from there. Pieces hide each
other in their order along the ray.

The colour of a piece is its light over its opacity, both attenuated by what of the
piece lies before. With u the difference of its ends' extinctions over their sum, ``x``
the share of the optical depth tau and ``gamma = 1/tau - 1/(exp(tau) - 1) - 1/2``, a
colour that is a straight line along a piece has the mean ``middle + u/6 * difference``
over x, and the straight line in x next to it rises by ``(1 - u**2 / 5) * difference``;
attenuated, that shifts the mean by gamma times the rise. Both are exact where
extinction is constant.
"""

import numpy as np
from numba import njit

from renderers.art.kernels.classify import classify
from renderers.art.kernels.march_types import F32, I32, End, Lanes, Three
from renderers.art.kernels.opacity import HALF, ONE, ZERO, opacity
from renderers.simd import absolute, any_, gather, maximum, rows4, rows8, select

SIXTH, FIFTH = np.float32(1 / 6), np.float32(1 / 5)
G1, G3 = np.float32(-1 / 12), np.float32(1 / 720)
G5, G7 = np.float32(-1 / 30240), np.float32(1 / 1209600)


@njit(cache=True, nogil=True, error_model="numpy")
def _pieces_of(extinction: F32, v: Lanes, piece: Lanes, mixed: Lanes) -> Lanes:
    """Advance from piece to piece until each density lies in its own."""
    _, upper, _, _ = rows4(extinction, piece)
    later = mixed & (v >= upper)
    while any_(later):
        piece = select(later, piece + np.int32(1), piece)
        _, upper, _, _ = rows4(extinction, piece)
        later = later & (v >= upper)
    return piece


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def end_of(
    lines: F32, first: I32, extinction: F32, color: F32, slope: F32,
    bins: Three, v: Lanes, at: Lanes,
) -> End:  # fmt: skip
    """Return what the ends of segments need of densities; see a `Classification`."""
    kappa, r, g, b, bin_, mixed = classify(
        lines, first, extinction, color, slope, bins, v, at
    )
    piece = gather(first, select(at, bin_, 0), at)
    if any_(mixed):
        piece = _pieces_of(extinction, v, piece, mixed)
    return piece, kappa, r, g, b


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _tilt(k0: Lanes, k1: Lanes, tau: Lanes, a: Lanes) -> Lanes:
    """Return how far from the middle of a piece its colour is, -1/2 to 1/2.

    k0, k1: extinctions of its ends. tau, a: its optical depth and opacity.
    """
    u = (k1 - k0) / (k0 + k1)
    q = tau * tau
    thin = tau * ((G1 + q * G3) + (q * q) * (G5 + q * G7))
    shift = select(tau < ONE, thin, (a - tau) / (tau * a) + HALF)
    return maximum(u * SIXTH + (ONE - (u * u) * FIFTH) * shift, -HALF)


@njit(cache=True, nogil=True, error_model="numpy")
def _whole_pieces(
    sums: F32, first: Lanes, last: Lanes, beyond: Lanes, scale: Lanes
) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return opacities and colours of the pieces from `first` up to `last`.

    A function of its own, as `between_nodes` is.
    """
    d1, s1, x1, y1, z1, w1, m1, n1 = rows8(sums, select(beyond, last, 0))
    d0, s0, x0, y0, z0, w0, m0, n0 = rows8(sums, select(beyond, first, 0))
    depth = (d1 - d0) + (s1 - s0)
    some = depth > ZERO
    return (
        opacity(depth * scale),
        select(some, ((x1 - x0) + (y1 - y0)) / depth, ZERO),
        select(some, ((z1 - z0) + (w1 - w0)) / depth, ZERO),
        select(some, ((m1 - m0) + (n1 - n0)) / depth, ZERO),
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _beyond_nodes(
    extinction: F32, color: F32, sums: F32, crossing: Lanes, p0: Lanes, scale: Lanes,
    v1: Lanes, end: End, before: tuple[Lanes, Lanes, Lanes, Lanes],
) -> tuple[Lanes, Lanes, Lanes, Lanes]:  # fmt: skip
    """Add what lies behind the first node on their way to segments that cross nodes.

    scale: mm a unit of density. before: opacity and colour up to the node.
    """
    p1, e1, r1, g1, b1 = end
    a0, r0, g0, b0 = before
    p0, p1 = select(crossing, p0, 0), select(crossing, p1, 0)
    rising = p1 > p0
    first = select(rising, p0, p1) + np.int32(1)
    last = select(rising, p1, p0)
    am, rm, gm, bm = a0 * ZERO, a0 * ZERO, a0 * ZERO, a0 * ZERO
    beyond = crossing & (last > first)
    if any_(beyond):
        am, rm, gm, bm = _whole_pieces(sums, first, last, beyond, scale)
    node = select(rising, last, first)
    at_node, _, ke, _ = rows4(extinction, node)
    kr, kg, kb, _ = rows4(color, node)
    tau = (absolute(v1 - at_node) * scale) * (HALF * (ke + e1))
    a1 = opacity(tau)
    some = a1 > ZERO
    w = _tilt(ke, e1, tau, a1)
    rb = select(some, HALF * (kr + r1) + (r1 - kr) * w, ZERO)
    gb = select(some, HALF * (kg + g1) + (g1 - kg) * w, ZERO)
    bb = select(some, HALF * (kb + b1) + (b1 - kb) * w, ZERO)
    some = a0 > ZERO
    r, g, b = select(some, r0, ZERO), select(some, g0, ZERO), select(some, b0, ZERO)
    t0, tm = ONE - a0, ONE - am
    total = a0 + t0 * (am + tm * a1)
    per = ONE / total
    return (
        select(crossing, total, a0),
        select(crossing, (a0 * r + t0 * (am * rm + tm * (a1 * rb))) * per, r0),
        select(crossing, (a0 * g + t0 * (am * gm + tm * (a1 * gb))) * per, g0),
        select(crossing, (a0 * b + t0 * (am * bm + tm * (a1 * bb))) * per, b0),
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def integrate(
    extinction: F32, color: F32, sums: F32, h: Lanes, joined: Lanes, v0: Lanes,
    start: End, v1: Lanes, end: End, zero: Lanes,
) -> tuple[Lanes, Lanes, Lanes, Lanes]:  # fmt: skip
    """Return opacities and colours of segments of h mm from v0 to v1, for `joined`.

    start, end: what `end_of` says of their densities. sums: of `sums_at_nodes`.
    """
    p0, e0, r0, g0, b0 = start
    p1, e1, r1, g1, b1 = end
    crossing = joined & (p0 != p1)
    crosses = any_(crossing)
    near, scale, ke, kr, kg, kb = h, h, e1, r1, g1, b1
    if crosses:
        # up to the first node on the way
        node = select(crossing, select(p1 > p0, p0 + 1, p0), 0)
        at_node, _, k_, _ = rows4(extinction, node)
        r_, g_, b_, _ = rows4(color, node)
        scale = h / absolute(v1 - v0)
        near = select(crossing, absolute(at_node - v0) * scale, h)
        ke, kr = select(crossing, k_, e1), select(crossing, r_, r1)
        kg, kb = select(crossing, g_, g1), select(crossing, b_, b1)
    alpha, r, g, b = zero, zero, zero, zero
    tau = near * (HALF * (e0 + ke))
    if any_(joined & (tau > ZERO)):
        alpha = opacity(tau)
        w = _tilt(e0, ke, tau, alpha)
        r = HALF * (r0 + kr) + (kr - r0) * w
        g = HALF * (g0 + kg) + (kg - g0) * w
        b = HALF * (b0 + kb) + (kb - b0) * w
    if crosses:
        alpha, r, g, b = _beyond_nodes(
            extinction, color, sums, crossing, p0, scale, v1, end, (alpha, r, g, b)
        )
    return alpha, r, g, b
