"""What lists and culls sixteen at a time, against its definition."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.kernels.list_surfels import is_hidden, list_tile
from renderers.fsr.kernels.project_surfels import NO_TILE, tile_range
from renderers.fsr.kernels.surfel_tiles import (
    BLOCK,
    BLOCKS,
    BLOCKS_X,
    BLOCKS_Y,
    MOST_TILES,
    SQUARE,
    TILE_HEIGHT,
    TILE_WIDTH,
)
from renderers.fsr.surfels.surfel_buffers import lined_up

TILES = st.integers(0, MOST_TILES - 1)
SPANS = st.tuples(TILES, TILES).map(lambda ends: (min(ends), max(ends)))


@given(
    spans=st.lists(st.none() | st.tuples(SPANS, SPANS), max_size=40),
    column=TILES,
    row=TILES,
)
def test_a_tile_lists_those_whose_range_holds_it(
    spans: list[tuple[tuple[int, int], tuple[int, int]] | None], column: int, row: int
) -> None:
    ranges = np.zeros(len(spans) + SQUARE, np.int32)
    wanted = []
    for n, span in enumerate(spans):
        ranges[n] = NO_TILE
        if span is not None:
            (left, right), (top, bottom) = span
            ranges[n] = np.int64(tile_range(left, right, top, bottom)).astype(np.int32)
            if left <= column <= right and top <= row <= bottom:
                wanted.append(n)
    items = np.full(len(spans) + SQUARE, -1, np.int32)
    found = list_tile(ranges, len(spans), column, row, items)
    assert items[:found].tolist() == wanted


@given(
    seed=st.integers(0, 1 << 30),
    box=st.tuples(*[st.integers(-40, 300)] * 4),
    depth=st.floats(-1, 30, width=32),
)
def test_a_surfel_is_hidden_where_all_its_blocks_are_nearer(
    seed: int, box: tuple[int, int, int, int], depth: float
) -> None:
    left, top = TILE_WIDTH, TILE_HEIGHT
    x0, x1 = sorted(box[:2])
    y0, y1 = sorted(box[2:])
    far = lined_up(BLOCKS)
    rng = np.random.default_rng(seed)
    far[:] = rng.choice(np.array([0.05, 0.1, 0.5, np.inf], np.float32), BLOCKS)
    columns = range(
        max(x0 - left, 0) // BLOCK, min(x1 - left, TILE_WIDTH - 1) // BLOCK + 1
    )
    rows = range(max(y0 - top, 0) // BLOCK, min(y1 - top, TILE_HEIGHT - 1) // BLOCK + 1)
    if not columns or not rows or depth == 0:
        return
    least = min(far[y * BLOCKS_X + x] for y in rows for x in columns if y < BLOCKS_Y)
    boxes = np.array([[0, 0, 0, 0], [x0, x1, y0, y1]], np.int32)
    hidden = is_hidden(far, boxes, 1, left, top, np.float32(depth))
    assert hidden == (least * np.float32(depth) >= 1)
