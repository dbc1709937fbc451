"""Compiled redistancing: start values at the zero set, then fast sweeping."""

from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def start_values(
    a: Any, h: Any, deepest: Any, farthest: Any, d: Any, fixed: Any
) -> None:
    """Fill unsigned distances next to sign changes of `a`, and their limits elsewhere.

    deepest, farthest: the limits where `a` is negative and where it is not.

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
                    fixed[z, y, x] = 1
                else:
                    d[z, y, x] = deepest if s else farthest
                    fixed[z, y, x] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def sweep(d: Any, fixed: Any, h: Any, far: Any, rounds: int) -> None:
    """Solve the eikonal equation outwards from the fixed values (Zhao 2005).

    Each round passes the grid in all eight directions. Distances of `far` and more
    are not followed.
    """
    nz, ny, nx = d.shape
    two, three = np.float32(2), np.float32(3)
    least = h * np.float32(0.577)
    for order in range(8 * rounds):
        for kk in range(nz):
            z = kk if order & 1 else nz - 1 - kk
            for jj in range(ny):
                y = jj if order & 2 else ny - 1 - jj
                for ii in range(nx):
                    x = ii if order & 4 else nx - 1 - ii
                    if fixed[z, y, x]:
                        continue
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
                    if t < d[z, y, x]:
                        d[z, y, x] = min(t, far)
