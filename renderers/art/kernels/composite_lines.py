"""Compiled: integrate a transfer function along lines through a volume, unlit."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import Classification
from renderers.art.kernels.bent_samples import U, opacity
from renderers.art.kernels.opacity import HALF, ONE, ZERO
from renderers.art.kernels.segments import FIFTH, G1, G3, G5, G7, SIXTH


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


@njit(cache=True, nogil=True, error_model="numpy")
def _across(plane: NDArray[Any], ix: int, iy: int, fx: float, fy: float) -> float:
    """Interpolate between four voxels of a plane."""
    row, next_ = plane[U(iy)], plane[U(iy + 1)]
    a, b = float(row[U(ix)]), float(next_[U(ix)])
    a += (float(row[U(ix + 1)]) - a) * fx
    b += (float(next_[U(ix + 1)]) - b) * fx
    return a + (b - a) * fy


@njit(cache=True, nogil=True, error_model="numpy")
def _density(values: NDArray[Any], x: float, y: float, z: float) -> np.float32:
    """Interpolate between eight voxels, in float64."""
    nz, ny, nx = values.shape
    ix = min(max(int(x), 0), nx - 2)
    iy = min(max(int(y), 0), ny - 2)
    iz = min(max(int(z), 0), nz - 2)
    fx, fy, fz = x - ix, y - iy, z - iz
    near = _across(values[U(iz)], ix, iy, fx, fy)
    return np.float32(near + (_across(values[U(iz + 1)], ix, iy, fx, fy) - near) * fz)


@njit(cache=True, nogil=True, error_model="numpy")
def composite_lines(
    values: NDArray[Any],
    start: NDArray[np.float64],
    way: NDArray[np.float64],
    length_mm: NDArray[np.float64],
    step_mm: float,
    cutoff: float,
    table: Classification,
    sums: NDArray[np.float32],
    found: NDArray[np.float64],
) -> None:
    """Write premultiplied colour and opacity of each line into found (n, 4).

    values: ``(nz, ny, nx)``. start: (n, 3) voxels x y z. way: (n, 3) voxels per mm.
    A line ends when less than `cutoff` of its light is left, or where a density is not
    finite. sums: see `segment`.
    """
    for line in range(len(start)):
        x, y, z = start[line, 0], start[line, 1], start[line, 2]
        count = max(1, math.ceil(length_mm[line] / step_mm))
        h = length_mm[line] / count
        left = 1.0
        for c in range(4):
            found[line, c] = 0.0
        v0 = _density(values, x, y, z)
        if not abs(v0) < np.inf:
            continue
        p0, e0, r0, g0, b0 = classify(table, v0)
        for i in range(1, count + 1):
            s = i * h
            v1 = _density(
                values,
                x + s * way[line, 0],
                y + s * way[line, 1],
                z + s * way[line, 2],
            )
            if not abs(v1) < np.inf:
                break
            p1, e1, r1, g1, b1 = classify(table, v1)
            if p0 == p1 and e0 == e1 == 0:
                v0, r0, g0, b0 = v1, r1, g1, b1
                continue
            alpha, red, green, blue = segment(
                table, sums, np.float32(h),
                v0, p0, e0, r0, g0, b0, v1, p1, e1, r1, g1, b1,
            )  # fmt: skip
            v0, p0, e0, r0, g0, b0 = v1, p1, e1, r1, g1, b1
            if not alpha > 0:
                continue
            weight = left * float(alpha)
            found[line, 0] += weight * red
            found[line, 1] += weight * green
            found[line, 2] += weight * blue
            found[line, 3] += weight
            left -= weight
            if left < cutoff:
                break
