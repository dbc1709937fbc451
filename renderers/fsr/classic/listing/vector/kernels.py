"""Strips listed with vectors; what is done is told in the scalar twin."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.listing.kernels import (
    ROOM,
    SPARE,
    nearing,
    shells_of,
    split_near,
    with_room,
)
from renderers.fsr.classic.survey.kernels import BESIDE, BINS, SOME
from renderers.fsr.classic.survey.vector.kernels import clip_rows, survey_spans

F32 = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def list_strip(
    rows: Any, splats: Any, eye: Any, planes: F32, split_at: Any, shelling: Any
) -> Any:
    """Do as the scalar twin."""
    count = rows[0].shape[0]
    spans = np.empty((count, 3), np.int32)
    lowest = np.empty(count + SPARE, np.int32)
    highest = np.empty(count + SPARE, np.int32)
    ends = np.empty((4, SOME + SPARE), np.float32)
    bins = np.zeros((BESIDE, BINS), np.int64)
    near = np.empty(ROOM, np.int32)
    of_eye = nearing(eye)
    kept = nears = 0
    for row in range(0, count, SOME):
        listed = kept
        kept = clip_rows(
            rows, row, min(row + SOME, count), eye[0], planes, kept, spans, ends
        )
        near = with_room(near, nears, spans[listed:kept])
        nears = survey_spans(
            spans, listed, kept, ends, rows[3], of_eye, lowest, highest, bins,
            near, nears,
        )  # fmt: skip
    places, paints, keys, cut = split_near(near[:nears], splats, eye, split_at)
    counted = bins.sum(axis=0)
    shells = shells_of(counted, eye, shelling)
    return (
        spans[:kept], lowest, highest, counted.sum(), places, paints, keys, cut,
        shells[: shells.shape[0] if kept > 0 else 0],
    )  # fmt: skip
