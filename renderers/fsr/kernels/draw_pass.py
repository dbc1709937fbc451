"""The draw passes of a list of splats, in one call.

The splats near the eye, which are not the set's own, are drawn first, then the rest
depth slab by depth slab, or all at once in an order that is given. A pass selects its
splats, projects, sorts and composites them, so that splats of a later slab where no
light is left are not even projected.

Each thread draws a band of the picture from a list of its own: threads share nothing,
and none waits for the interpreter's lock.
"""

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import I32, I64, Lanes
from renderers.fsr.kernels.clip_rows import Rows
from renderers.fsr.kernels.composite import draw_tiles
from renderers.fsr.kernels.cull_view import CulledSplats
from renderers.fsr.kernels.depth_slabs import find_waiting, select_slab
from renderers.fsr.kernels.depth_sort import begin_keys, count_keys, place_by_keys
from renderers.fsr.kernels.project_splats import (
    SplatBuffers,
    Splats,
    Style,
    project_splats,
)
from renderers.fsr.kernels.subdivide import NEAR_KEYS
from renderers.fsr.kernels.tile_buffer import TILE_SIDE, Canvas, TileBuffer
from renderers.fsr.kernels.view_planes import GridView

ALIKE: Lanes = np.bool_(False)
SIZED: Lanes = np.bool_(True)
"""Splats of size one, and of others. A literal would compile what takes it again."""
PART = 256
"""Spans whose elements are selected, projected and counted in the cache."""


@njit(cache=True, nogil=True, error_model="numpy")
def look_for_light(
    alive: I64, down: int, across: int, waiting: I32
) -> tuple[bool, I32]:
    """Return whether there is light left, and `waiting`, see `find_waiting`.

    Where all tiles take all light, it has no elements.
    """
    some, every = False, True
    for tile in range(alive.shape[0]):
        some = some or alive[tile] != 0
        every = every and alive[tile] == -1
    if every:
        return some, waiting[:0]
    find_waiting(alive, down, across, waiting)
    return some, waiting


@njit(cache=True, nogil=True, error_model="numpy")
def sort_by_key(n: int, first_key: int, end_key: int, buffers: SplatBuffers) -> int:
    """Sort n splats, whose keys are counted; return the number of those that show."""
    counts, entries = buffers.counts, buffers.entries
    visible = begin_keys(counts, first_key, end_key)
    # in order, so that they are in the cache when they are written here and there,
    # where one that is not holds up those that follow
    entries[:visible] = 0
    place_by_keys(buffers.ranges[:n], buffers.keys[:n], counts, entries)
    counts[first_key:end_key] = 0
    return visible


@njit(cache=True, nogil=True, error_model="numpy")
def _project(
    first: int, n: int, splats: Splats, sized: bool, view: GridView, style: Style,
    buffers: SplatBuffers,
) -> None:  # fmt: skip
    """Project n splats of the buffers from the first on and count their keys."""
    ranges = buffers.ranges[first:]
    project_splats(
        buffers.numbers[first:], n, splats, sized, view, style, buffers.records[first:],
        buffers.boxes[first:], ranges,
    )  # fmt: skip
    count_keys(ranges[:n], buffers.keys[first : first + n], buffers.counts)


@njit(cache=True, nogil=True, error_model="numpy")
def _project_slab(
    first_key: int, end_key: int, culled: CulledSplats, splats: Splats, rows: Rows,
    view: GridView, style: Style, waiting: I32, buffers: SplatBuffers,
) -> int:  # fmt: skip
    """Select a slab's splats part by part and project them; return their number."""
    spans, lowest, highest = culled.spans, culled.lowest, culled.highest
    index, keys = buffers.numbers, buffers.keys
    n = 0
    for a in range(0, spans.shape[0], PART):
        b = min(a + PART, spans.shape[0])
        selected = select_slab(
            spans[a:b], lowest[a:b], highest[a:b], rows, view, style.reach_mm,
            first_key, end_key, waiting, index[n:], keys[n:],
        )  # fmt: skip
        _project(n, selected, splats, ALIKE, view, style, buffers)
        n += selected
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def draw_list(
    culled: CulledSplats, order: I32, splats: Splats, rows: Rows, view: GridView,
    style: Style, buffers: SplatBuffers, tiles: TileBuffer, canvas: Canvas,
) -> tuple[int, int]:  # fmt: skip
    """Draw a list; return the splats projected that show, and the fragments.

    order: the set's splats to be drawn after the near ones; no elements where these are
    drawn slab by slab. buffers: for all near splats or all of the list. tiles: those
    that take no light are left alone.
    """
    index, keys = buffers.numbers, buffers.keys
    down = (canvas.image.shape[0] + TILE_SIDE - 1) // TILE_SIDE
    across = (canvas.image.shape[1] + TILE_SIDE - 1) // TILE_SIDE
    slabs = culled.slab_ends
    passes = 1 + (1 if order.size > 0 else slabs.shape[0])
    visible = fragments = 0
    # not a literal: what takes it would be compiled twice
    end_key: Lanes = np.int64(0)
    start: Lanes = np.int64(0)
    for number in range(passes):
        first_key = end_key
        last = number == passes - 1
        if number > 0 and order.size == 0:
            light, waiting = look_for_light(tiles.alive, down, across, tiles.waiting)
            if not light:
                break
            end_key = slabs[number - 1]
            n = _project_slab(
                first_key, end_key, culled, splats, rows, view, style, waiting, buffers
            )
        elif number > 0:
            n = order.shape[0]
            index[:n] = order
            keys[:n] = 0
            _project(start, n, splats, ALIKE, view, style, buffers)
        else:
            n = culled.near_keys.shape[0]
            for s in range(n):
                index[s] = s
                keys[s] = culled.near_keys[s]
            _project(start, n, culled.near, SIZED, view, style, buffers)
        begin, end = (first_key, end_key) if end_key > 0 else (0, NEAR_KEYS)
        shown = sort_by_key(n, begin, end, buffers)
        if shown > 0 or last:
            tiles.counter[0] = 0
            fragments += draw_tiles(buffers, shown, style.points, last, tiles, canvas)
        visible += shown
    return visible, fragments
