"""Splats cut into eight of half the size, and these again, where they are too near."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.shells.kernels import depth_of

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
Real = float | np.float32


@njit(cache=True, nogil=True, error_model="numpy")
def split_splats(
    index: I32, places: F32, paints: F32, base: F32, matrix: F32, flat: bool,
    least_mm: Real, last: Real,
) -> Any:  # fmt: skip
    """Give the parts of splats, and whole those that are far enough.

    index: which of the splats. places, paints: see `PaintedSet`. base, matrix, flat:
    see `survey_spans`. least_mm: a splat nearer than this, or half a one nearer than
    half of it, is cut into eight on a lattice of half the spacing, which share its
    extinction and volume. last: the size that is not cut again; of the whole it is one.
    Returns places, paints, how many splats were cut, and for each part a number of 64
    bits by which nearer ones come first, ties in their order; its low half numbers the
    parts.
    """
    # most of those that are split are split once
    room = 9 * index.shape[0] + 64
    found = np.empty((room, 4), np.float32)
    colours = np.empty((room, 4), np.float32)
    order = np.empty(room, np.int64)
    waiting = np.empty((64, 5), np.float32)
    eighth, half = np.float32(0.125), np.float32(0.5)
    n = 0
    cut = 0
    for s in index:
        for c in range(4):
            waiting[0, c] = places[s, c]
        waiting[0, 4] = 1
        top = 1
        while top > 0:
            top -= 1
            x, y, z = waiting[top, 0], waiting[top, 1], waiting[top, 2]
            mass, size = waiting[top, 3], waiting[top, 4]
            depth = np.float32(
                depth_of(x - base[0], y - base[1], z - base[2], matrix, flat)
            )
            if size > last and depth < size * least_mm and not flat:
                cut += 1
                step = size * np.float32(0.25)
                for corner in range(8):
                    waiting[top, 0] = x + step if corner & 1 else x - step
                    waiting[top, 1] = y + step if corner & 2 else y - step
                    waiting[top, 2] = z + step if corner & 4 else z - step
                    waiting[top, 3] = mass * eighth
                    waiting[top, 4] = size * half
                    top += 1
                continue
            if n == room:
                room *= 2
                found = np.concatenate((found, np.empty_like(found)))
                colours = np.concatenate((colours, np.empty_like(colours)))
                order = np.concatenate((order, np.empty_like(order)))
            found[n, 0], found[n, 1], found[n, 2], found[n, 3] = x, y, z, mass
            for c in range(3):
                colours[n, c] = paints[s, c]
            colours[n, 3] = paints[s, 3] * size
            order[n] = (np.int64(depth.view(np.int32)) << 32) | n
            n += 1
    return found[:n], colours[:n], cut, order[:n]
