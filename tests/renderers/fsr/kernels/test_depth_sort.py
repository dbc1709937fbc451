import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.kernels import depth_sort
from renderers.fsr.kernels.depth_sort import NOWHERE

tile = st.integers(0, 7)
block = st.tuples(tile, tile, tile, tile)


@given(
    boxes=st.lists(st.one_of(block, st.none()), max_size=60),
    tiles=block,
)
def test_a_block_of_tiles_lists_the_splats_that_meet_it_in_their_order(
    boxes: list[tuple[int, int, int, int] | None], tiles: tuple[int, int, int, int]
) -> None:
    """And a tile those that a list of its row has in its column."""
    left, right = sorted(tiles[:2])
    top, bottom = sorted(tiles[2:])
    room = np.full((8, len(boxes) + 16), -1, np.int32)
    ranges, numbers = room[0], room[1]
    wanted, in_column = [], []
    for s, box in enumerate(boxes):
        numbers[s] = 3 * s
        if box is None:
            ranges[s] = NOWHERE
            continue
        (a, b), (c, d) = sorted(box[:2]), sorted(box[2:])
        ranges[s] = a | b << 8 | c << 16 | d << 24
        if a <= right and b >= left and c <= bottom and d >= top:
            wanted.append(3 * s)
            in_column += [3 * s] if a <= left <= b else []
    items, own, listed = room[2:5]
    n = depth_sort.list_block(
        ranges, numbers, len(boxes), top, bottom, left, right, items, own
    )
    assert items[:n].tolist() == wanted
    assert own[:n].tolist() == [ranges[s // 3] for s in wanted]
    items[:], own[:] = -1, -1
    entries = ranges.astype(np.int64) << 32 | numbers
    n = depth_sort.list_entries(
        entries, len(boxes), top, bottom, left, right, items, own
    )
    assert items[:n].tolist() == wanted
    assert own[:n].tolist() == [ranges[s // 3] for s in wanted]
    assert listed[: depth_sort.list_tile(items, own, n, left, listed)].tolist() == (
        in_column
    )
