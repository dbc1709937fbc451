"""Compiled: Gaussian blurs of rows of colour planes, along them and across them.

Taps are symmetric: the centre, then one side, `spacing` pixels apart. Rows of planes
are three channels of `pitch` values (see the exposing kernels); here they are named by
their flat index, and rings of them by that of their first row.
"""

# Vectors are types of the compiler alone, which the one that gives one cannot name.
# mypy: disable-error-code="no-untyped-def"

import numpy as np
from numba import njit

from renderers.simd import load, store
from renderers.simd.arrays import Floats, Longs

Count = int | np.int64
W = 32


@njit(cache=True, nogil=True, error_model="numpy")
def blur_along(
    source: Floats,
    at: int,
    taps: Floats,
    spacing: Count,
    blurred: Floats,
    to: int,
    pitch: int,
    first: int,
    last: int,
) -> None:
    """Blur values `first` to `last` of each channel of a row; whole vectors."""
    for c in range(3):
        for x in range(c * pitch + first, c * pitch + last, W):
            total = taps[0] * load(source, at + x, W)
            for k in range(1, taps.shape[0]):
                step = k * spacing
                pair = load(source, at + x - step, W) + load(source, at + x + step, W)
                total = total + taps[k] * pair
            store(blurred, to + x, total)


@njit(cache=True, nogil=True, error_model="numpy")
def find_rows(
    row: Count,
    rows: int,
    spacing: Count,
    start: Count,
    ring: int,
    size: int,
    places: Longs,
) -> None:
    """Give where the rows of the taps on either side of `row` lie in a ring of rows.

    places: (taps, 2), flat indices of the rows above and below. The picture's first
    and last row repeat beyond its edges.
    """
    for k in range(places.shape[0]):
        places[k, 0] = start + max(row - k * spacing, 0) % ring * size
        places[k, 1] = start + min(row + k * spacing, rows - 1) % ring * size


@njit(cache=True, nogil=True, error_model="numpy")
def across(source, places, taps, x):
    """Blur one vector of values over the rows at `places`."""
    total = taps[0] * load(source, places[0, 0] + x, W)
    for k in range(1, taps.shape[0]):
        above = load(source, places[k, 0] + x, W)
        total = total + taps[k] * (above + load(source, places[k, 1] + x, W))
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def blur_across(
    source: Floats,
    places: Longs,
    taps: Floats,
    blurred: Floats,
    to: int,
    pitch: int,
    first: int,
    last: int,
) -> None:
    """Blur values `first` to `last` of each channel over the rows at `places`."""
    for c in range(3):
        for x in range(c * pitch + first, c * pitch + last, W):
            store(blurred, to + x, across(source, places, taps, x))
