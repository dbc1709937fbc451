"""A screen band in one call: cull the view, then draw it.

Python between the two stages would hold up the other threads: it runs in one thread at
a time, and a thread that waits for it falls asleep.
"""

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, Lanes
from renderers.fsr.kernels.clip_rows import Rows
from renderers.fsr.kernels.cull_view import Culling, cull_view
from renderers.fsr.kernels.draw_pass import draw_list
from renderers.fsr.kernels.project_splats import SplatBuffers, Splats, Style
from renderers.fsr.kernels.tile_buffer import Canvas, TileBuffer
from renderers.fsr.kernels.view_planes import GridView


@njit(cache=True, nogil=True, error_model="numpy")
def cull_and_draw(
    rows: Rows, splats: Splats, view: GridView, planes: F32, culling: Culling,
    style: Style, buffers: SplatBuffers, most: int, tiles: TileBuffer, canvas: Canvas,
) -> tuple[int, int, int, int, int, int]:  # fmt: skip
    """List what a band shows and draw it, unless the buffers are too small.

    most: splats that the buffers hold. Returns elements and spans listed, splats that
    were subdivided, those that show, fragments, and the splats the buffers must hold.
    """
    culled = cull_view(rows, splats, view, planes, culling)
    needed = max(culled.listed, culled.near_keys.shape[0])
    # not a literal: what takes it would be compiled twice
    visible: Lanes = np.int64(0)
    fragments: Lanes = np.int64(0)
    if needed <= most:
        none = np.empty(0, np.int32)
        visible, fragments = draw_list(
            culled, none, splats, rows, view, style, buffers, tiles, canvas
        )
    spans = culled.spans.shape[0]
    return culled.listed, spans, culled.subdivided, visible, fragments, needed
