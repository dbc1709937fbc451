"""Strips listed with vectors; what is done is told in the scalar twin."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.clip_rows import (
    are_within,
    clip_rows,
    find_ends,
    survey_spans,
)
from renderers.fsr.kernels.clip_rows_scalar import BESIDE, BINS, SOME
from renderers.fsr.kernels.cull_view_scalar import (
    ROOM,
    SPARE,
    finish_list,
    nearing,
    with_room,
)

F32 = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def list_strip(
    rows: Any, splats: Any, eye: Any, planes: F32, split_at: Any, shelling: Any
) -> Any:
    """Do as the scalar twin, but that rows are not looked at if all are within."""
    count = rows[0].shape[0]
    is_whole = are_within(rows[5], eye[0], planes)
    spans = rows[4] if is_whole else np.empty((count + SPARE, 3), np.int32)
    lowest = np.empty(count + SPARE, np.uint16)
    highest = np.empty(count + SPARE, np.uint16)
    ends = np.empty((4, SOME + SPARE), np.float32)
    bins = np.zeros((BESIDE, BINS), np.int64)
    near = np.empty(ROOM, np.int32)
    of_eye = nearing(eye)
    is_near = of_eye[5] > 0
    kept = nears = 0
    for row in range(0, count, SOME):
        listed = kept
        if is_whole:
            kept = min(row + SOME, count)
            find_ends(rows[2], row, kept, eye[0], ends)
        else:
            kept = clip_rows(
                rows[:4], row, min(row + SOME, count), eye[0], planes, kept, spans, ends
            )
        if is_near:
            near = with_room(near, nears, spans[listed:kept])
        nears = survey_spans(
            spans, listed, kept, ends, rows[3], of_eye, lowest, highest, bins,
            near, nears,
        )  # fmt: skip
    return finish_list(
        spans[:kept], lowest, highest, bins, near[:nears], splats, eye, split_at,
        shelling,
    )  # fmt: skip
