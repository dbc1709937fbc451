"""Redistancing: start values at the zero set, then fast sweeping."""

import numpy as np
from numba import njit

from anatomy.kernels.tables import Bytes, Floats

ASLEEP, FIXED, TISSUE, AIR = 0, 1, 2, 3
"""States of a voxel: nothing to do; given; awake in tissue; awake in air."""


@njit(cache=True, nogil=True, error_model="numpy")
def _wake(
    a: Floats, inside: bool, z: int, y: int, x: int, state: Bytes, rows: Bytes
) -> None:
    """Wake the neighbours of a fixed voxel that are on its side of the surface."""
    nz, ny, nx = a.shape
    for axis in range(3):
        for step in (-1, 1):
            k = z + step if axis == 0 else z
            j = y + step if axis == 1 else y
            i = x + step if axis == 2 else x
            if k < 0 or j < 0 or i < 0 or k >= nz or j >= ny or i >= nx:
                continue
            if state[k, j, i] == ASLEEP and (a[k, j, i] < np.float32(0)) == inside:
                state[k, j, i] = AIR if inside else TISSUE
                rows[1 if inside else 0, k, j] = 1


@njit(cache=True, nogil=True, error_model="numpy")
def start_values(
    a: Floats,
    h: np.float32,
    deepest: np.float32,
    farthest: np.float32,
    d: Floats,
    state: Bytes,
    rows: Bytes,
) -> None:
    """Fill unsigned distances next to sign changes of `a`, and their limits elsewhere.

    deepest, farthest: the limits where `a` is negative and where it is not. state:
    all `ASLEEP`; the filled voxels become `FIXED` and wake their neighbours. rows
    ``(2, nz, ny)``: zeros; 1 where a row has a voxel awake in tissue, in air.

    Along each axis the crossing lies at ``h |a| / (|a| + |b|)``; the plane through
    the three crossings has distance ``1 / sqrt(sum of inverse squares)``, exact for
    planes and free of central differences, which fail on walls two voxels thick.
    """
    nz, ny, nx = a.shape
    zero, one = np.float32(0), np.float32(1)
    for z in range(nz):
        for y in range(ny):
            for x in range(nx):
                v = a[z, y, x]
                s = v < zero
                total = zero
                for axis in range(3):
                    best = zero
                    for step in (-1, 1):
                        k = z + step if axis == 0 else z
                        j = y + step if axis == 1 else y
                        i = x + step if axis == 2 else x
                        if k < 0 or j < 0 or i < 0 or k >= nz or j >= ny or i >= nx:
                            continue
                        w = a[k, j, i]
                        if (w < zero) != s:
                            # A value of zero at both ends has its crossing here.
                            span = abs(v) + abs(w)
                            t = h * (abs(v) / span if span > zero else zero)
                            t = max(t, np.float32(1e-6))
                            best = max(best, one / (t * t))
                    total += best
                if total > zero:
                    d[z, y, x] = one / np.sqrt(total)
                    state[z, y, x] = FIXED
                    _wake(a, s, z, y, x, state, rows)
                else:
                    d[z, y, x] = deepest if s else farthest


@njit(cache=True, nogil=True, error_model="numpy")
def sweep(
    d: Floats,
    state: Bytes,
    rows: Bytes,
    mine: int,
    h: np.float32,
    far: np.float32,
    rounds: int,
) -> None:
    """Solve the eikonal equation outwards from the fixed values (Zhao 2005).

    Each round passes the grid in all eight directions. Distances of `far` and more
    are not followed. mine: `AIR` or `TISSUE`, the space to fill; fixed voxels part
    the two. A voxel sleeps until a neighbour has changed to less than its own value
    (locking, Bak, McLaughlin and Renzi 2010), which changes no bit. rows ``(nz,
    ny)``: 1 where a row may have a voxel awake.
    """
    nz, ny, nx = d.shape
    two, three = np.float32(2), np.float32(3)
    least = h * np.float32(0.577)
    # What rounding may take from a solution, and more.
    slack = h * np.float32(0.001)
    for order in range(8 * rounds):
        for kk in range(nz):
            z = kk if order & 1 else nz - 1 - kk
            for jj in range(ny):
                y = jj if order & 2 else ny - 1 - jj
                if not rows[z, y]:
                    continue
                left = False
                for ii in range(nx):
                    x = ii if order & 4 else nx - 1 - ii
                    if state[z, y, x] != mine:
                        continue
                    state[z, y, x] = ASLEEP
                    a = min(d[max(z - 1, 0), y, x], d[min(z + 1, nz - 1), y, x])
                    b = min(d[z, max(y - 1, 0), x], d[z, min(y + 1, ny - 1), x])
                    c = min(d[z, y, max(x - 1, 0)], d[z, y, min(x + 1, nx - 1)])
                    if a > b:
                        a, b = b, a
                    if b > c:
                        b, c = c, b
                    if a > b:
                        a, b = b, a
                    # No solution is less than a + h / sqrt(3).
                    if a + least >= d[z, y, x]:
                        continue
                    t = a + h
                    if t > b:
                        q = two * h * h - (a - b) * (a - b)
                        t = (a + b + np.sqrt(q)) / two
                        if t > c:
                            s = a + b + c
                            q = s * s - three * (a * a + b * b + c * c - h * h)
                            t = (s + np.sqrt(max(q, np.float32(0)))) / three
                    if t >= d[z, y, x]:
                        continue
                    t = min(t, far)
                    d[z, y, x] = t
                    t -= slack
                    for axis in range(3):
                        for step in (-1, 1):
                            k = z + step if axis == 0 else z
                            j = y + step if axis == 1 else y
                            i = x + step if axis == 2 else x
                            if min(k, j, i) < 0 or k >= nz or j >= ny or i >= nx:
                                # At the border a voxel is its own neighbour.
                                k, j, i = z, y, x
                            if state[k, j, i] == ASLEEP and d[k, j, i] > t:
                                state[k, j, i] = mine
                                rows[k, j] = 1
                                left = left or (k == z and j == y)
                rows[z, y] = left
