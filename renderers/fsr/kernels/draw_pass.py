"""Lists drawn with vectors; what is done is told in the scalar twin."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.composite import draw_tiles
from renderers.fsr.kernels.depth_slabs import take_shell
from renderers.fsr.kernels.depth_sort_scalar import count_keys
from renderers.fsr.kernels.draw_pass_scalar import (
    ALIKE,
    PART,
    count_in_order,
    count_near,
    look_for_light,
    put_in_order,
)
from renderers.fsr.kernels.project_splats import project_splats
from renderers.fsr.splats.near_splats import NEAR_KEYS
from renderers.fsr.splats.splat_stages import DRAW, ORDER, PROJECT
from renderers.fsr.splats.splat_tiles import TILE_SIDE
from renderers.lanes.cycle_counter import passed, ticks

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
U16 = NDArray[np.uint16]
I64 = NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def _project(
    index: I32, n: int, splats: Any, sized: bool, seen_by: Any, look: Any,
    records: F32, boxes: I32, ranges: I32, keys: I32, counts: I32,
) -> None:  # fmt: skip
    """Do as the scalar twin."""
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
    """Do as the scalar twin."""
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
    """Do as the scalar twin."""
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
