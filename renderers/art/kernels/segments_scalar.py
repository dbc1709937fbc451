"""Integrate a transfer function along a segment between two samples.

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
from numpy.typing import NDArray

from renderers.art.cells.brick_views import Classification
from renderers.art.kernels.opacity_scalar import HALF, ONE, ZERO, opacity

SIXTH, FIFTH = np.float32(1 / 6), np.float32(1 / 5)
G1, G3 = np.float32(-1 / 12), np.float32(1 / 720)
G5, G7 = np.float32(-1 / 30240), np.float32(1 / 1209600)


@njit(cache=True, nogil=True, error_model="numpy")
def classify(
    table: Classification, v: np.float32
) -> tuple[int, np.float32, np.float32, np.float32, np.float32]:
    """Give the piece between nodes that a density lies in, extinction and colour."""
    place = min(max((v - table.low) * table.scale + ONE, ZERO), table.last)
    bin_ = int(place)
    f = place - np.float32(bin_)
    k = int(table.first[bin_])
    line = table.lines[bin_]
    kappa = line[0] + f * line[1]
    r, g, b = line[2] + f * line[3], line[4] + f * line[5], line[6] + f * line[7]
    if kappa < ZERO:
        while v >= table.extinction[k, 1]:
            k += 1
        x = max(v - table.extinction[k, 0], ZERO)
        kappa = table.extinction[k, 2] + x * table.extinction[k, 3]
        r = table.color[k, 0] + x * table.color_slope[k, 0]
        g = table.color[k, 1] + x * table.color_slope[k, 1]
        b = table.color[k, 2] + x * table.color_slope[k, 2]
    return k, kappa, r, g, b


@njit(cache=True, nogil=True, error_model="numpy")
def tilt(k0: np.float32, k1: np.float32, tau: np.float32, a: np.float32) -> np.float32:
    """Say how far from the middle of a piece its colour is, -1/2 to 1/2.

    k0, k1: extinctions of its ends. tau, a: its optical depth and opacity.
    """
    u = (k1 - k0) / (k0 + k1)
    if tau < ONE:
        q = tau * tau
        shift = tau * ((G1 + q * G3) + (q * q) * (G5 + q * G7))
    else:
        shift = (a - tau) / (tau * a) + HALF
    return max(u * SIXTH + (ONE - (u * u) * FIFTH) * shift, -HALF)


@njit(cache=True, nogil=True, error_model="numpy")
def segment(
    table: Classification, sums: NDArray[np.float32], h: np.float32,
    v0: np.float32, p0: int, e0: np.float32,
    r0: np.float32, g0: np.float32, b0: np.float32,
    v1: np.float32, p1: int, e1: np.float32,
    r1: np.float32, g1: np.float32, b1: np.float32,
) -> tuple[np.float32, np.float32, np.float32, np.float32]:  # fmt: skip
    """Give opacity and colour of a segment of h mm; no colour where it is clear.

    sums: float32 (pieces, 8), what `sums_at_nodes` gives. v, p, e, r, g, b: density at
    an end, and what `classify` says of it.
    """
    near, scale, node = h, ONE, p0
    ke, kr, kg, kb = e1, r1, g1, b1
    if p0 != p1:
        node = p0 + 1 if p1 > p0 else p0
        scale = h / abs(v1 - v0)
        near = abs(table.extinction[node, 0] - v0) * scale
        ke = table.extinction[node, 2]
        kr, kg, kb = table.color[node, 0], table.color[node, 1], table.color[node, 2]
    tau = near * (HALF * (e0 + ke))
    alpha = opacity(tau)
    r, g, b = ZERO, ZERO, ZERO
    if alpha > ZERO:
        w = tilt(e0, ke, tau, alpha)
        r = HALF * (r0 + kr) + (kr - r0) * w
        g = HALF * (g0 + kg) + (kg - g0) * w
        b = HALF * (b0 + kb) + (kb - b0) * w
    if p0 == p1:
        return alpha, r, g, b
    first, last = node, node
    if p1 > p0:
        last = p1
    else:
        first = p1 + 1
    depth = (sums[last, 0] - sums[first, 0]) + (sums[last, 1] - sums[first, 1])
    am = opacity(depth * scale)
    rm, gm, bm = ZERO, ZERO, ZERO
    if depth > ZERO:
        rm = (
            (sums[last, 2] - sums[first, 2]) + (sums[last, 3] - sums[first, 3])
        ) / depth
        gm = (
            (sums[last, 4] - sums[first, 4]) + (sums[last, 5] - sums[first, 5])
        ) / depth
        bm = (
            (sums[last, 6] - sums[first, 6]) + (sums[last, 7] - sums[first, 7])
        ) / depth
    # the other end's node, which may be the same
    node = first + last - node
    ke = table.extinction[node, 2]
    tau = (abs(v1 - table.extinction[node, 0]) * scale) * (HALF * (ke + e1))
    a1 = opacity(tau)
    rb, gb, bb = ZERO, ZERO, ZERO
    if a1 > ZERO:
        kr, kg, kb = table.color[node, 0], table.color[node, 1], table.color[node, 2]
        w = tilt(ke, e1, tau, a1)
        rb = HALF * (kr + r1) + (r1 - kr) * w
        gb = HALF * (kg + g1) + (g1 - kg) * w
        bb = HALF * (kb + b1) + (b1 - kb) * w
    t0, tm = ONE - alpha, ONE - am
    total = alpha + t0 * (am + tm * a1)
    per = ONE / total
    return (
        total,
        (alpha * r + t0 * (am * rm + tm * (a1 * rb))) * per,
        (alpha * g + t0 * (am * gm + tm * (a1 * gb))) * per,
        (alpha * b + t0 * (am * bm + tm * (a1 * bb))) * per,
    )
