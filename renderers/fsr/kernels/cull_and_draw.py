"""What a thread does of a picture, in one call: cull the view, then draw it.

Python between the two stages would hold up the other threads: it runs in one thread at
a time, and a thread that waits for it falls asleep.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.cull_view import list_strip
from renderers.fsr.kernels.draw_pass import draw_pieces
from renderers.fsr.splats.splat_stages import CULL, WAIT
from renderers.lanes.atomics import take_turn, wait_for_none
from renderers.lanes.cycle_counter import passed, ticks

F32 = NDArray[np.float32]
I64 = NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def list_and_draw(
    rows: Any, splats: Any, eye: Any, planes: F32, split_at: Any, shelling: Any,
    ny: int, seen_by: Any, look: Any, room: Any, most: int, tiles: Any,
    scratch: Any, canvas: Any, others: Any, spent: I64,
) -> Any:  # fmt: skip
    """List what a strip shows and draw it, unless there is no room.

    rows, splats, eye, planes, split_at, shelling: see `list_strip`; ny, seen_by, look,
    room, tiles, scratch, canvas: see `draw_pieces`; most: splats there is room for.
    others: what calls the threads that draw the other strips, how many are busy, and
    how often to look, when all is done, whether they still are (`ThreadTeam.map`).
    spent: ``(5,)`` ticks by stage, added to. Returns elements and spans that were
    listed, splats that were split, those that show, fragments, and the splats there
    must be room for.
    """
    bell, busy, looks = others
    take_turn(bell)
    now = ticks()
    spans, lowest, highest, count, places, paints, keys, cut, shells = list_strip(
        rows, splats, eye, planes, split_at, shelling
    )
    now = passed(spent, CULL, now)
    wanted = max(count, keys.shape[0])
    # not a literal: what takes it would be compiled twice
    visible: Any = np.int64(0)
    fragments: Any = np.int64(0)
    if wanted <= most:
        none = np.empty(0, np.int32)
        visible, fragments = draw_pieces(
            (places, paints, keys), splats, rows[3], ny, none,
            (spans, lowest, highest, eye[3], eye[4], eye[5]), shells, seen_by, look,
            room, tiles, scratch, canvas, spent,
        )  # fmt: skip
        now = ticks()
        wait_for_none(busy, looks)
        passed(spent, WAIT, now)
    return count, spans.shape[0], cut, visible, fragments, wanted
