"""Rows clipped against the view, and the order of what remains.

Rows are clipped in voxel coordinates, so that planes, sphere and eye are affine in the
column and one row is one interval.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U16 = NDArray[np.uint16]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _turn(step: int, n: int, eye: int) -> int:
    """Give the step-th index of 0..n-1 from far to near, seen from index `eye`."""
    if step < eye:
        return step
    if step < n - 1:
        return n - 1 - (step - eye)
    return eye


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _first_from(x: U16, first: int, end: int, column: int) -> int:
    """Find the first of a row's elements that is not before a column."""
    while first < end:
        middle = (first + end) >> 1
        if x[middle] < column:
            first = middle + 1
        else:
            end = middle
    return first


@njit(cache=True, nogil=True, error_model="numpy")
def cull_rows(
    offsets: I64, x: U16, nx: int, ny: int, nz: int, planes: F64, eye_mm: F64,
    axes_mm: F64, reach_mm: float, eye_index: I64, spans: I32,
) -> tuple[int, int]:  # fmt: skip
    """Clip all rows against the view; list what is left of them, far to near.

    planes: ``(p, 4)`` float64, a point (i, j, k) is inside where
        ``a i + b j + c k + d >= 0`` for all of them.
    eye_mm, axes_mm: world position of voxel 0 from the eye, and ``(3, 3)`` world
        steps of i, j, k in rows; elements farther than `reach_mm` are left out.
    eye_index: the eye's voxel (i, j, k), clamped into the grid.
    spans: ``(rows, 3)``, a row ``k * ny + j`` and its first and last + 1 element.
    Returns (spans, elements).
    """
    n = 0
    kept = 0
    last = float(nx - 1)
    limited = not math.isinf(reach_mm)
    a2 = axes_mm[0, 0] ** 2 + axes_mm[0, 1] ** 2 + axes_mm[0, 2] ** 2
    for step in range(nz):
        k = _turn(step, nz, eye_index[2])
        if offsets[k * ny] == offsets[(k + 1) * ny]:
            continue
        outside = False
        for p in range(planes.shape[0]):
            # the best corner of the slice still misses the plane
            top = planes[p, 2] * k + planes[p, 3]
            top += max(planes[p, 0] * last, 0.0) + max(planes[p, 1] * (ny - 1), 0.0)
            if top < 0:
                outside = True
                break
        if outside:
            continue
        for turn in range(ny):
            j = _turn(turn, ny, eye_index[1])
            row = k * ny + j
            first = offsets[row]
            end = offsets[row + 1]
            if first == end:
                continue
            low = 0.0
            high = last
            if limited:
                bx = eye_mm[0] + j * axes_mm[1, 0] + k * axes_mm[2, 0]
                by = eye_mm[1] + j * axes_mm[1, 1] + k * axes_mm[2, 1]
                bz = eye_mm[2] + j * axes_mm[1, 2] + k * axes_mm[2, 2]
                g = bx * axes_mm[0, 0] + by * axes_mm[0, 1] + bz * axes_mm[0, 2]
                c = bx * bx + by * by + bz * bz - reach_mm * reach_mm
                square = g * g - a2 * c
                if square < 0:
                    continue
                root = math.sqrt(square)
                low = max(low, (-g - root) / a2)
                high = min(high, (-g + root) / a2)
            for p in range(planes.shape[0]):
                slope = planes[p, 0]
                rest = planes[p, 1] * j + planes[p, 2] * k + planes[p, 3]
                if slope > 0:
                    low = max(low, -rest / slope)
                elif slope < 0:
                    high = min(high, -rest / slope)
                elif rest < 0:
                    high = -1.0
            if high < low:
                continue
            first = _first_from(x, first, end, math.ceil(low - 1e-6))
            end = _first_from(x, first, end, math.floor(high + 1e-6) + 1)
            if first == end:
                continue
            spans[kept, 0] = row
            spans[kept, 1] = first
            spans[kept, 2] = end
            kept += 1
            n += end - first
    return kept, n


@njit(cache=True, nogil=True, error_model="numpy")
def list_spans(
    spans: I32, kept: int, x: U16, eye_column: int, index: I32, row_of: I32
) -> None:
    """List the elements of the first spans: each row from both ends to the eye's."""
    n = 0
    for span in range(kept):
        s = spans[span, 1]
        end = spans[span, 2]
        while s < end and x[s] < eye_column:
            index[n] = s
            row_of[n] = spans[span, 0]
            n += 1
            s += 1
        t = end - 1
        while t >= s:
            index[n] = t
            row_of[n] = spans[span, 0]
            n += 1
            t -= 1
