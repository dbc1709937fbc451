"""Near splats subdivided: each into eight of half the size, and these again.

The projection of a footprint is made straight at its centre. That fails from an
angular sigma of about 0.1 on: at 0.2 the footprint is already a fifth too narrow. The
eight lie on a lattice of half the spacing and share the splat's extinction and
volume, so that what it hides stays the same.
"""

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, Lanes, Real
from renderers.fsr.kernels.project_splats import Splats
from renderers.fsr.kernels.view_planes import ORTHOGRAPHIC, GridView, depth_of

WIDEST_SIGMA = 0.1
"""Angular sigma, in radians, above which a splat is subdivided."""
LAST_SIGMA = 0.5
"""And above which one is left out that has been subdivided often enough."""
SPLITS = 3
"""Times that a splat is subdivided at most: one of 0.3 mm sigma reaches 0.04 mm then
and is drawn from 0.08 mm on."""
NEAR_KEYS = 4096
"""Distances told apart in the depth sort of near splats and parts."""
PARTS_REACH = 1.25
"""Distance of the farthest part of a near splat, in distances from which none is near.

That is six times the widest spacing or more, and parts lie within .87 of it.
"""
MOST = 8**SPLITS
"""Parts of a splat that is subdivided as often as any is."""


@njit(cache=True, nogil=True, error_model="numpy")
def _subdivide_some(
    index: I32, first: int, n: int, cut: int, splats: Splats, view: GridView,
    least_mm: Real, last: Real, found: Splats, depths: F32,
) -> tuple[int, int, int]:  # fmt: skip
    """Subdivide from one of the splats on until the next may not fit.

    n, cut: parts and cuts there are already. Returns the splat to go on with, and how
    many parts and cuts there are then.
    """
    places, colors = splats
    new_places, new_colors = found
    base, matrix = view.base, view.matrix
    flat = view.projection == ORTHOGRAPHIC
    waiting = np.empty((64, 5), np.float32)
    eighth, half = np.float32(0.125), np.float32(0.5)
    while first < index.shape[0] and n + MOST <= depths.shape[0]:
        # unsigned: an index that never counts from the end needs no test
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
            new_places[at, 0], new_places[at, 1] = x, y
            new_places[at, 2], new_places[at, 3] = z, mass
            for c in range(3):
                new_colors[at, c] = colors[s, c]
            new_colors[at, 3] = colors[s, 3] * size
            depths[at] = depth
            n += 1
    return first, n, cut


@njit(cache=True, nogil=True, error_model="numpy")
def subdivide(
    index: I32, splats: Splats, view: GridView, least_mm: Real, last: Real
) -> tuple[Splats, int, F32]:
    """Return the parts of splats, and whole those that are far enough.

    index: which of the splats. least_mm: a splat nearer than this, or half a one nearer
    than half of it, is cut into eight. last: the size that is not cut again, of the
    whole it is one; half to the power of `SPLITS` at least. Returns the parts, how many
    splats were cut, and how far away each part is.
    """
    # most of those that are subdivided are subdivided once
    size = 9 * index.shape[0] + MOST
    places = np.empty((size, 4), np.float32)
    colors = np.empty((size, 4), np.float32)
    depths = np.empty(size, np.float32)
    first = n = cut = 0
    while first < index.shape[0]:
        first, n, cut = _subdivide_some(
            index, first, n, cut, splats, view, least_mm, last,
            Splats(places, colors), depths,
        )  # fmt: skip
        if first < index.shape[0]:
            # grown here: arrays that a loop may exchange cost it most of its time
            places = np.concatenate((places, np.empty_like(places)))
            colors = np.concatenate((colors, np.empty_like(colors)))
            depths = np.concatenate((depths, np.empty_like(depths)))
    return Splats(places[:n], colors[:n]), cut, depths[:n]


@njit(cache=True, nogil=True, error_model="numpy")
def subdivide_near(
    near: I32, splats: Splats, view: GridView, least_mm: Real, last: Real
) -> tuple[Splats, I32, int]:
    """Subdivide near splats; return the parts, their keys and how many splats were cut.

    A key is a power of two times as fine as those of all splats. It does not depend on
    which splats are near: neither does the order.
    """
    parts, cut, depths = subdivide(near, splats, view, least_mm, last)
    low, scale = view.low, view.keys_per_mm
    keys = np.empty(depths.shape[0], np.int32)
    fine: Lanes = np.float32(1)
    reach = (view.near_mm * np.float32(PARTS_REACH) - low) * scale
    while reach > 0 and 2 * fine * reach <= NEAR_KEYS:
        fine *= np.float32(2)
    for part in range(depths.shape[0]):
        step = max((depths[part] - low) * scale, np.float32(0)) * fine
        keys[part] = int(min(step, np.float32(NEAR_KEYS - 1)))
    return parts, keys, cut
