"""A list of splats drawn, in one call.

Splats are drawn in parts: those near the eye, which are not the set's own, then the
rest depth slab by depth slab, or all at once in an order that is given. A part is
taken, projected, sorted and composited before the next, so that splats of a later slab
where no light is left are not even projected.

Each thread draws a band of the picture from a list of its own: threads share nothing,
and none waits for the interpreter's lock.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.composite import draw_tiles
from renderers.fsr.kernels.depth_slabs import find_waiting, take_shell
from renderers.fsr.kernels.depth_sort import (
    begin_keys,
    count_keys,
    place_by_keys,
)
from renderers.fsr.kernels.project_splats import project_splats
from renderers.fsr.splats.near_splats import NEAR_KEYS
from renderers.fsr.splats.splat_stages import DRAW, ORDER, PROJECT
from renderers.fsr.splats.splat_tiles import TILE_SIDE
from renderers.lanes.cycle_counter import passed, ticks

ALIKE: Any = np.bool_(False)
"""Splats of size one. A literal would compile what takes it a second time."""
PART = 256
"""Spans whose elements are taken, projected and counted while they are in the cache."""
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
U16 = NDArray[np.uint16]
I64 = NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def look_for_light(alive: I64, down: int, across: int, waiting: I32) -> Any:
    """Say whether there is light left, and give `waiting`, see `find_waiting`.

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
def put_in_order(
    n: int, first_key: int, end_key: int, ranges: I32, keys: I32, counts: I32,
    entries: I64,
) -> int:  # fmt: skip
    """Put a piece's n splats, whose keys are counted, in order; give those that show.

    counts: ``(KEYS,)``, zeros again afterwards.
    """
    visible = begin_keys(counts, first_key, end_key)
    # in order, so that they are in the cache when they are written here and there,
    # where one that is not holds up those that follow
    entries[:visible] = 0
    place_by_keys(ranges[:n], keys[:n], counts, entries)
    counts[first_key:end_key] = 0
    return visible


@njit(cache=True, nogil=True, error_model="numpy")
def count_in_order(given: I32, index: I32, keys: I32) -> None:
    """Take splats as they are given; all have one key."""
    for s in range(given.shape[0]):
        index[s] = given[s]
        keys[s] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def count_near(near_keys: I32, index: I32, keys: I32) -> None:
    """Take all near splats, with their keys."""
    for s in range(near_keys.shape[0]):
        index[s] = s
        keys[s] = near_keys[s]


@njit(cache=True, nogil=True, error_model="numpy")
def _project(
    index: I32, n: int, splats: Any, sized: bool, seen_by: Any, look: Any,
    records: F32, boxes: I32, ranges: I32, keys: I32, counts: I32,
) -> None:  # fmt: skip
    """Project n splats and count their keys."""
    places, paints = splats
    base, matrix, projection, scale, width, height = seen_by
    sigma, widest, points, sheet_share, _ = look
    project_splats(
        index, n, places, paints, base, matrix, sigma, projection, scale, width, height,
        widest, sized, points, sheet_share, records, boxes, ranges,
    )  # fmt: skip
    count_keys(ranges[:n], keys[:n], counts)


@njit(cache=True, nogil=True, error_model="numpy")
def _project_shell(
    first_key: int, end_key: int, listed: Any, columns: U16, ny: int, splats: Any,
    seen_by: Any, look: Any, waiting: I32, room: Any,
) -> int:  # fmt: skip
    """Take a shell's splats part by part and project them; give their number."""
    spans, lowest, highest, low, per_mm, near_mm = listed
    base, matrix, projection, scale, width, height = seen_by
    index, keys, records, boxes, ranges, counts, _ = room
    n = 0
    for a in range(0, spans.shape[0], PART):
        b = min(a + PART, spans.shape[0])
        taken = take_shell(
            spans[a:b], lowest[a:b], highest[a:b], ny, columns, base, matrix,
            projection, low, per_mm, near_mm, first_key, end_key, scale, look[4], width,
            height, waiting, index[n:], keys[n:],
        )  # fmt: skip
        _project(
            index[n:], taken, splats, ALIKE, seen_by, look, records[n:], boxes[n:],
            ranges[n:], keys[n:], counts,
        )  # fmt: skip
        n += taken
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def draw_pieces(
    near: Any, own: Any, columns: U16, ny: int, given: I32, listed: Any, shells: I64,
    seen_by: Any, look: Any, room: Any, tiles: Any, scratch: Any, canvas: Any,
    spent: I64,
) -> Any:  # fmt: skip
    """Draw a list; give the number of splats projected that show, and the fragments.

    near: places, paints and keys (see `SplatList`) of splats to be drawn first. own:
    places and paints of the set; columns, ny: see `take_shell`. given: those of the set
    to be drawn, in this order; no elements where shells are taken. listed: spans,
    lowest and highest (see `SplatList`), low, scale and near_mm (see `survey_spans`).
    shells: last + 1 key of each. seen_by: base, matrix, projection, scale, width and
    height; look: sigma, widest, points, sheet_share (see `project_splats`) and reach_mm
    (see `take_shell`). room: index, keys, records, boxes, ranges, counts (``(KEYS,)``
    zeros) and entries, for all near splats or all of the list, and sixteen more. tiles:
    states, depths, alive, drawn, fresh and turns (see `draw_tiles`), and waiting (see
    `find_waiting`); tiles that take no light are left alone. scratch: items, limits,
    sums, sheets and far; canvas: image, depth, limit_mm, cut and sheets_of; see
    `draw_tiles`. spent: ``(5,)`` ticks by stage, added to.
    """
    index, keys, records, boxes, ranges, counts, entries = room
    states, depths, alive, drawn, fresh, turns, waiting = tiles
    items, limits, sums, sheets, far = scratch
    image, depth, limit_mm, cut, sheets_of = canvas
    down = (image.shape[0] + TILE_SIDE - 1) // TILE_SIDE
    across = (image.shape[1] + TILE_SIDE - 1) // TILE_SIDE
    pieces = 1 + (1 if given.size > 0 else shells.shape[0])
    visible = fragments = 0
    # not a literal: what takes it would be compiled twice
    end_key: Any = np.int64(0)
    now = ticks()
    for piece in range(pieces):
        first_key = end_key
        last = piece == pieces - 1
        if piece > 0 and given.size == 0:
            light, sets = look_for_light(alive, down, across, waiting)
            if not light:
                break
            end_key = shells[piece - 1]
            n = _project_shell(
                first_key, end_key, listed, columns, ny, own, seen_by, look, sets, room
            )
        else:
            # the near ones, or all in an order that is given
            n = near[0].shape[0] if piece == 0 else given.shape[0]
            if piece == 0:
                count_near(near[2], index, keys)
            else:
                count_in_order(given, index, keys)
            _project(
                index, n, near[:2] if piece == 0 else own, piece == 0, seen_by, look,
                records, boxes, ranges, keys, counts,
            )  # fmt: skip
        now = passed(spent, PROJECT, now)
        first, end = (first_key, end_key) if end_key > 0 else (0, NEAR_KEYS)
        some = put_in_order(n, first, end, ranges, keys, counts, entries)
        now = passed(spent, ORDER, now)
        if some > 0 or last:
            turns[0] = 0
            fragments += draw_tiles(
                records.reshape(-1), boxes, entries, some, turns, look[2], cut,
                sheets_of, limit_mm, fresh, last, items, limits, sums, sheets, far,
                states, depths, alive, drawn, image, depth,
            )  # fmt: skip
        visible += some
        now = passed(spent, DRAW, now)
    return visible, fragments
