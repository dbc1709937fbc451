"""Which blocks of a picture are drawn, by whom, and what is left of them."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.art.blocks import MOST_WAITING, Blocks, Strip, draw_strip
from renderers.art.kernels.march_types import BLOCK_COLUMNS, TILE_PX, BlockMemory
from renderers.art.regions import Gather


def keep_all(
    corners: NDArray[np.int32], turns: NDArray[np.int64], limit: int, from_end: bool,
    lens: Any, setup: Any, memory: BlockMemory, *rest: Any
) -> tuple[int, int, int]:  # fmt: skip
    """Keep every block; number them in the counts of their rays."""
    waiting, counts = memory.waiting, memory.rays.samples
    kept = 0
    while kept < len(waiting) and turns[0] < limit:
        turns[0] += 1
        waiting[kept] = turns[1]
        turns[1] += 1
        first = kept * (BLOCK_COLUMNS * TILE_PX + 1)
        counts[first : first + BLOCK_COLUMNS * TILE_PX] = waiting[kept]
        kept += 1
    return kept, 0, 0


def draw(
    kernel: Callable[..., tuple[int, int, int]], blocks: Blocks, along: bool
) -> Strip:
    unread: Any = ()
    return draw_strip(
        kernel, blocks, 0, unread, unread, Gather(9, 9), unread, np.zeros(4, np.int64),
        takes_along=along,
    )  # fmt: skip


@given(
    st.integers(1, 60), st.integers(1, 600), st.integers(0, 3), st.integers(0, 2**32)
)
def test_blocks_cover_what_is_left_once(
    height: int, width: int, holes: int, seed: int
) -> None:
    """All of it; nothing of a block that is done, or that nobody wants."""
    rng = np.random.default_rng(seed)
    left, wanted = np.ones((2, height, width), np.bool_)
    for mask in (left, wanted)[:holes]:
        mask[rng.integers(0, height) :, rng.integers(0, width) :] = False
    blocks = Blocks.of((height, width), left, wanted if holes > 1 else None)
    seen = np.zeros((height, width), np.int32)
    for number in range(len(blocks.corners)):
        region = blocks.region(number)
        assert 0 < region.bottom - region.top <= TILE_PX
        assert 0 < region.right - region.left <= BLOCK_COLUMNS
        seen[region.rows, region.columns] += 1
        assert left[region.rows, region.columns].any()
        assert wanted[region.rows, region.columns].any()
    assert seen.max(initial=0) <= 1
    assert seen[left & wanted].all()
    if holes == 0:
        everything = Blocks.of((height, width)).corners
        assert np.array_equal(everything, blocks.corners)


@pytest.mark.parametrize("along", [False, True])
def test_kept_blocks_wait_as_packets(along: bool) -> None:
    size = 5 * TILE_PX + 3, 3 * BLOCK_COLUMNS + 7
    blocks = Blocks.of(size)
    blocks.allow(1000)
    seen = np.zeros(size, np.int32)
    number = 0
    for kept in (MOST_WAITING, 24 - MOST_WAITING, 0):
        strip = draw(keep_all, blocks, along=along)
        assert strip.fresh == strip.early == 0
        assert len(strip.packets) == kept
        for packet in strip.packets:
            n = packet.region.pixels
            seen[packet.region.rows, packet.region.columns] += 1
            assert sorted(packet.order.tolist()) == list(range(n))
            assert len(packet.count) == len(packet.depth) == n
            assert set(packet.count.tolist()) == {number}
            assert len(packet.front) == (n + 1 if along else 0)
            for array in (packet.geometry, packet.cursor, packet.value, packet.carry):
                assert len(array) == n + 1
            number += 1
    assert (seen == 1).all()
    assert blocks.left == 0


def test_what_is_drawn_at_once_leaves_nothing() -> None:
    def draw_all(*_: object) -> tuple[int, int, int]:
        return 0, 77, 5

    strip = draw(draw_all, Blocks.of((9, 30)), along=False)
    assert not strip.packets
    assert (strip.fresh, strip.early) == (77, 5)
