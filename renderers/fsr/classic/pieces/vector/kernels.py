"""Pieces of lists with vectors; what is done is told in the scalar twin."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.ordering.kernels import count_keys
from renderers.fsr.classic.projection.vector.kernels import project_splats
from renderers.fsr.classic.shells.vector.kernels import take_shell
from renderers.scene.turns.kernels import take_part

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def project_piece(
    turns: I64, who: int, starts: I64, taken: I64, cuts: I64, index: I32, keys: I32,
    first_key: int, end_key: int, spans: Any, view: Any, look: Any, places: F32,
    paints: F32, records: F32, boxes: I32, ranges: I32, counts: I32,
) -> None:  # fmt: skip
    """Do as the scalar twin."""
    rows, lowest, highest, ny, columns, low, per_mm, near, reach, waiting = spans
    base, matrix, projection, scale, width, height = view
    sigma, widest, sized, points, sheet_share = look
    while True:
        part = take_part(turns, who, taken.shape[0])
        if part == taken.shape[0]:
            break
        here = starts[part]
        if cuts.size > 0:
            a, b = cuts[part], cuts[part + 1]
            taken[part] = take_shell(
                rows[a:b], lowest[a:b], highest[a:b], ny, columns, base, matrix,
                projection, low, per_mm, near, first_key, end_key, scale, reach, width,
                height, waiting, index[here:], keys[here:],
            )  # fmt: skip
        end = here + taken[part]
        project_splats(
            index[here:], taken[part], places, paints, base, matrix, sigma, projection,
            scale, width, height, widest, sized, points, sheet_share, records[here:],
            boxes[here:], ranges[here:],
        )  # fmt: skip
        count_keys(ranges[here:end], keys[here:end], first_key, end_key, counts[part])
