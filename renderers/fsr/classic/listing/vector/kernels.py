"""Strips listed with vectors; what is done is told in the scalar twin."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.listing.kernels import SPARE, shells_of, split_in_order
from renderers.fsr.classic.survey.kernels import BINS
from renderers.fsr.classic.survey.vector.kernels import clip_set, survey_spans

F32 = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def list_strip(
    rows: Any, splats: Any, eye: Any, planes: F32, split_at: Any, shelling: Any
) -> Any:
    """Do as the scalar twin."""
    numbers, extents, places, columns = rows
    base, matrix, flat, low, scale, near_mm = eye
    count = numbers.shape[0]
    spans = np.empty((count, 3), np.int32)
    ends = np.empty((4, count + SPARE), np.float32)
    begins = np.empty(count + 1, np.int64)
    kept = clip_set(
        numbers, extents, places, columns, base, planes, spans, ends, begins
    )
    lowest = np.empty(kept + SPARE, np.int32)
    highest = np.empty(kept + SPARE, np.int32)
    bins = np.empty(BINS, np.int64)
    is_near = near_mm > low
    near = np.empty(begins[kept] if is_near else 0, np.int32)
    nears = survey_spans(
        spans[:kept], ends, columns, base, matrix, flat, low, scale,
        near_mm if is_near else np.float32(-np.inf), lowest, highest, bins, near,
    )  # fmt: skip
    near_places, near_paints, cut = split_in_order(
        near[:nears], splats, base, matrix, flat, split_at
    )
    shells = shells_of(bins, matrix, low, shelling)
    return (
        spans[:kept], lowest, highest, begins[: kept + 1], near_places, near_paints,
        cut, shells[: shells.shape[0] if kept > 0 else 0],
    )  # fmt: skip
