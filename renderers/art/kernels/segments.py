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

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.classify import between_nodes, place_of
from renderers.art.kernels.opacity import HALF, ONE, ZERO, opacity
from renderers.lanes import (
    absolute,
    any_,
    f32,
    gather,
    i32,
    maximum,
    rows4,
    rows8,
    select,
)

Lanes = Any
"""A vector of `renderers.lanes`."""

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

SIXTH, FIFTH = np.float32(1 / 6), np.float32(1 / 5)
G1, G3 = np.float32(-1 / 12), np.float32(1 / 720)
G5, G7 = np.float32(-1 / 30240), np.float32(1 / 1209600)


@njit(cache=True, nogil=True, error_model="numpy")
def _pieces_of(extinction: F32, v: Lanes, piece: Lanes, mixed: Lanes) -> Lanes:
    """Go on from piece to piece until each density lies in its own."""
    _, upper, _, _ = rows4(extinction, piece)
    later = mixed & (v >= upper)
    while any_(later):
        piece = select(later, piece + np.int32(1), piece)
        _, upper, _, _ = rows4(extinction, piece)
        later = later & (v >= upper)
    return piece


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def classify(
    lines: F32, first: I32, extinction: F32, color: F32, slope: F32,
    low: np.float32, scale: np.float32, last: np.float32, v: Lanes, at: Lanes,
) -> tuple[Lanes, Lanes, Lanes, Lanes, Lanes]:  # fmt: skip
    """Give pieces between nodes, extinctions and colours; see a `Classification`."""
    place = place_of(v, low, scale, last)
    bin_ = i32(place)
    f = place - f32(bin_)
    kappa, dk, r, dr, g, dg, b, db = rows8(lines, bin_)
    piece = gather(first, select(at, bin_, 0), at)
    kappa, r, g, b = kappa + f * dk, r + f * dr, g + f * dg, b + f * db
    mixed = at & (kappa < ZERO)
    if any_(mixed):
        kappa, r, g, b = between_nodes(
            first, extinction, color, slope, bin_, v, mixed, kappa, r, g, b
        )
        piece = _pieces_of(extinction, v, piece, mixed)
    return piece, kappa, r, g, b


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def tilt(k0: Lanes, k1: Lanes, tau: Lanes, a: Lanes) -> Lanes:
    """Say how far from the middle of a piece its colour is, -1/2 to 1/2.

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
    """Give opacities and colours of the pieces from `first` up to `last`.

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
def beyond_nodes(
    extinction: F32, color: F32, sums: F32, crossing: Lanes,
    p0: Lanes, p1: Lanes, scale: Lanes, v1: Lanes, e1: Lanes,
    r1: Lanes, g1: Lanes, b1: Lanes, a0: Lanes, r0: Lanes, g0: Lanes, b0: Lanes,
) -> tuple[Lanes, Lanes, Lanes, Lanes]:  # fmt: skip
    """Add what lies behind the first node on their way to segments that cross nodes.

    scale: mm a unit of density. v1, p1, e1, r1, g1, b1: of the segments' far ends.
    a0, r0, g0, b0: what lies before the node.
    """
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
    w = tilt(ke, e1, tau, a1)
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
