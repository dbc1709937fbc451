"""Splats cut into eight of half the size, and these again, where they are too near."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.depth_slabs import depth_of
from renderers.fsr.splats.near_splats import SPLITS

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
Real = float | np.float32

MOST = 8**SPLITS
"""Parts of a splat that is cut as often as any is."""


@njit(cache=True, nogil=True, error_model="numpy")
def _split_some(
    index: I32, first: int, n: int, cut: int, splats: Any, eye: Any, split_at: Any,
    found: F32, colours: F32, depths: F32,
) -> Any:  # fmt: skip
    """Split from one of the splats on until there may be no room for the next.

    n, cut: parts and cuts there are already. Returns the splat to go on with, and how
    many parts and cuts there are then.
    """
    places, paints = splats
    base, matrix, flat = eye
    least_mm, last = split_at
    waiting = np.empty((64, 5), np.float32)
    eighth, half = np.float32(0.125), np.float32(0.5)
    while first < index.shape[0] and n + MOST <= depths.shape[0]:
        # unsigned: whether an index counts from the end need not be asked
        s = np.uint32(index[first])
        first += 1
        for c in range(4):
            waiting[0, c] = places[s, c]
        waiting[0, 4] = 1
        top = 1
        while top > 0:
            top -= 1
            t = np.uint32(top)
            x, y, z = waiting[t, 0], waiting[t, 1], waiting[t, 2]
            mass, size = waiting[t, 3], waiting[t, 4]
            depth = np.float32(
                depth_of(x - base[0], y - base[1], z - base[2], matrix, flat)
            )
            if size > last and depth < size * least_mm and not flat:
                cut += 1
                step = size * np.float32(0.25)
                for corner in range(8):
                    t = np.uint32(top)
                    waiting[t, 0] = x + step if corner & 1 else x - step
                    waiting[t, 1] = y + step if corner & 2 else y - step
                    waiting[t, 2] = z + step if corner & 4 else z - step
                    waiting[t, 3] = mass * eighth
                    waiting[t, 4] = size * half
                    top += 1
                continue
            at = np.uint32(n)
            found[at, 0], found[at, 1], found[at, 2], found[at, 3] = x, y, z, mass
            for c in range(3):
                colours[at, c] = paints[s, c]
            colours[at, 3] = paints[s, 3] * size
            depths[at] = depth
            n += 1
    return first, n, cut


@njit(cache=True, nogil=True, error_model="numpy")
def split_splats(
    index: I32, places: F32, paints: F32, base: F32, matrix: F32, flat: bool,
    least_mm: Real, last: Real,
) -> Any:  # fmt: skip
    """Give the parts of splats, and whole those that are far enough.

    index: which of the splats. places, paints: see `PaintedSet`. base, matrix, flat:
    see `survey_spans`. least_mm: a splat nearer than this, or half a one nearer than
    half of it, is cut into eight on a lattice of half the spacing, which share its
    extinction and volume. last: the size that is not cut again, of the whole it is one;
    half to the power of `SPLITS` at least. Returns places and paints, how many splats
    were cut, and how far away each part is.
    """
    # most of those that are split are split once
    room = 9 * index.shape[0] + MOST
    found = np.empty((room, 4), np.float32)
    colours = np.empty((room, 4), np.float32)
    depths = np.empty(room, np.float32)
    first = n = cut = 0
    while first < index.shape[0]:
        first, n, cut = _split_some(
            index, first, n, cut, (places, paints), (base, matrix, flat),
            (least_mm, last), found, colours, depths,
        )  # fmt: skip
        if first < index.shape[0]:
            # grown here: arrays that a loop may exchange cost it most of its time
            found = np.concatenate((found, np.empty_like(found)))
            colours = np.concatenate((colours, np.empty_like(colours)))
            depths = np.concatenate((depths, np.empty_like(depths)))
    return found[:n], colours[:n], cut, depths[:n]
