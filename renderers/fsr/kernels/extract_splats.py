"""Fuzzy sets taken from a volume, row by row.

Most voxels are turned down by their density alone; of what lies between the first and
the last of a row that are not, all gradients are made in one sweep.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I16, I64, U16, Lanes
from renderers.fsr.kernels.gradients import FlatVolume, sobel

UNDEFINED = -32768
"""Both octahedral components of a voxel whose gradient vanishes."""


class InclusionTable(NamedTuple):
    """F and its threshold.

    entries: ``(gradients, densities)``, bilinear, end values held. column_top: per
    density the maximum over gradients, so that most voxels are turned down before any
    neighbour is read.
    """

    entries: F32
    column_top: F32
    density_low: np.float32
    per_density: np.float32
    per_gradient: np.float32
    threshold: np.float32


class Elements(NamedTuple):
    """Columns, normals, densities and shares of some rows of a set."""

    x: U16
    octahedral: I16
    value: F32
    inclusion: F32


@njit(cache=True, nogil=True, error_model="numpy")
def _sobel_row(
    values: F32, nx: int, ny: int, nz: int, j: int, k: int, first: int, last: int,
    gx: F32, gy: F32, gz: F32,
) -> None:  # fmt: skip
    """Sum Sobel differences at a row's voxels first..last: a loop of vectors."""
    if first == 0:
        gx[0], gy[0], gz[0] = sobel(values, nx, ny, nz, 0, j, k)
    if last == nx - 1:
        gx[last], gy[last], gz[last] = sobel(values, nx, ny, nz, last, j, k)
    two = np.float32(2)
    jm = max(j - 1, 0) * nx
    jp = min(j + 1, ny - 1) * nx
    km = max(k - 1, 0) * (nx * ny)
    kp = min(k + 1, nz - 1) * (nx * ny)
    kc = k * (nx * ny)
    a = values[km + jm : km + jm + nx]
    b = values[km + j * nx : km + j * nx + nx]
    c = values[km + jp : km + jp + nx]
    d = values[kc + jm : kc + jm + nx]
    e = values[kc + j * nx : kc + j * nx + nx]
    f = values[kc + jp : kc + jp + nx]
    g = values[kp + jm : kp + jm + nx]
    h = values[kp + j * nx : kp + j * nx + nx]
    m = values[kp + jp : kp + jp + nx]
    for i in range(np.uint64(max(first, 1)), np.uint64(min(last, nx - 2) + 1)):
        o = i - np.uint64(1)
        p = i + np.uint64(1)
        sa = a[o] + two * a[i] + a[p]
        sc = c[o] + two * c[i] + c[p]
        sg = g[o] + two * g[i] + g[p]
        sm = m[o] + two * m[i] + m[p]
        gx[i] = ((a[p] - a[o]) + (c[p] - c[o]) + (g[p] - g[o]) + (m[p] - m[o])) + (
            two * ((b[p] - b[o]) + (d[p] - d[o]) + (f[p] - f[o]) + (h[p] - h[o]))
            + two * two * (e[p] - e[o])
        )
        gy[i] = (
            (sc - sa)
            + two * ((f[o] + two * f[i] + f[p]) - (d[o] + two * d[i] + d[p]))
            + (sm - sg)
        )
        gz[i] = (
            (sg - sa)
            + two * ((h[o] + two * h[i] + h[p]) - (b[o] + two * b[i] + b[p]))
            + (sm - sc)
        )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _column(density: np.float32, low: np.float32, scale: np.float32, tops: int) -> int:
    """Return the table's column at or below a density."""
    s = min(max((density - low) * scale, np.float32(0)), np.float32(tops))
    return min(int(s), tops - 1)


@njit(cache=True, nogil=True, error_model="numpy")
def extract_rows(
    volume: FlatVolume, inclusion: InclusionTable, row: int, end: int, offsets: I64,
    n: int, elements: Elements,
) -> int:  # fmt: skip
    """Append the voxels of rows `row`.. with F(gradient, density) >= threshold.

    n: elements there are already; ``offsets[row + 1]`` becomes their number after each
    row. Rows before `end` are done. Returns the first row that did not fit.
    """
    values, nx, ny, nz, half, direction = volume
    table, column_top, density_low, density_scale, gradient_scale, threshold = inclusion
    x, octahedral, value, share = elements
    tops = table.shape[1] - 1
    bins = table.shape[0] - 1
    sums_x = np.empty(nx, np.float32)
    sums_y = np.empty(nx, np.float32)
    sums_z = np.empty(nx, np.float32)
    while row < end:
        if n + nx > x.shape[0]:
            return row
        k = row // ny
        j = row - k * ny
        base = row * nx
        first = nx
        # not a literal: what takes it would be compiled twice
        last: Lanes = np.int64(-1)
        for i in range(nx):
            c = _column(values[base + i], density_low, density_scale, tops)
            if max(column_top[c], column_top[c + 1]) >= threshold:
                first = min(first, i)
                last = i
        if last >= 0:
            _sobel_row(values, nx, ny, nz, j, k, first, last, sums_x, sums_y, sums_z)
        for i in range(first, last + 1):
            density = values[base + i]
            s: Lanes = (density - density_low) * density_scale
            s = min(max(s, np.float32(0)), np.float32(tops))
            c = min(int(s), tops - 1)
            if max(column_top[c], column_top[c + 1]) < threshold:
                continue
            gx = sums_x[i] * half[0]
            gy = sums_y[i] * half[1]
            gz = sums_z[i] * half[2]
            length = math.sqrt(gx * gx + gy * gy + gz * gz)
            g = min(length * gradient_scale, np.float32(bins))
            b = min(int(g), bins - 1)
            fs = s - np.float32(c)
            fg = g - np.float32(b)
            low = table[b, c] + fs * (table[b, c + 1] - table[b, c])
            high = table[b + 1, c] + fs * (table[b + 1, c + 1] - table[b + 1, c])
            t = low + fg * (high - low)
            if not t >= threshold:
                continue
            x[n] = i
            value[n] = density
            share[n] = t
            if length > 0:
                r = np.float32(-1) / length
                wx = r * (
                    direction[0, 0] * gx + direction[0, 1] * gy + direction[0, 2] * gz
                )
                wy = r * (
                    direction[1, 0] * gx + direction[1, 1] * gy + direction[1, 2] * gz
                )
                wz = r * (
                    direction[2, 0] * gx + direction[2, 1] * gy + direction[2, 2] * gz
                )
                s1 = np.float32(1) / (abs(wx) + abs(wy) + abs(wz))
                u = wx * s1
                v = wy * s1
                if wz < 0:
                    fu = (np.float32(1) - abs(v)) * (1 if u >= 0 else -1)
                    fv = (np.float32(1) - abs(u)) * (1 if v >= 0 else -1)
                    u = fu
                    v = fv
                octahedral[n, 0] = math.floor(u * 32767 + 0.5)
                octahedral[n, 1] = math.floor(v * 32767 + 0.5)
            else:
                octahedral[n, 0] = UNDEFINED
                octahedral[n, 1] = UNDEFINED
            n += 1
        row += 1
        offsets[row] = n
    return row
