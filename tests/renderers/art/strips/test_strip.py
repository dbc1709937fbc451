"""What a strip leaves: packets of the blocks whose rays wait."""

from collections.abc import Callable
from typing import Any

import numpy as np

from renderers.art.regions import Gather, Region
from renderers.art.strips import Strip, draw_strip
from renderers.art.views import BLOCK_COLUMNS, TILE_PX


def keep_all(
    bounds: tuple[int, int, int, int], rays: Any, place: Any, least_left: np.float32,
    memory: Any, picture: Any, rest: Any,
) -> tuple[int, int, int]:  # fmt: skip
    """Keep every block; number them in the counts of their rays."""
    corners, counts = memory[0], memory[2]
    left, top, right, bottom = bounds
    kept = 0
    for y in range(top, bottom, TILE_PX):
        for x in range(left, right, BLOCK_COLUMNS):
            corners[kept] = x, y
            first = kept * (BLOCK_COLUMNS * TILE_PX + 1)
            counts[first : first + BLOCK_COLUMNS * TILE_PX] = kept
            kept += 1
    return kept, 0, 0


def draw(
    kernel: Callable[..., tuple[int, int, int]], region: Region, along: bool
) -> Strip:
    gather, counters = Gather(region.right, region.bottom), np.zeros(4, np.int64)
    left = np.float32(0.5)
    return draw_strip(
        kernel, region, (), (), left, gather, (), counters, takes_along=along
    )


def test_kept_blocks_cover_the_strip_once() -> None:
    region = Region(3, 5, 3 + 2 * BLOCK_COLUMNS + 7, 5 + 2 * TILE_PX + 3)
    for takes_along in (False, True):
        strip = draw(keep_all, region, along=takes_along)
        assert strip.fresh == strip.early == 0
        assert len(strip.packets) == 9
        seen = np.zeros((40, 600), np.int32)
        for number, packet in enumerate(strip.packets):
            n = packet.region.pixels
            seen[packet.region.rows, packet.region.columns] += 1
            assert sorted(packet.order.tolist()) == list(range(n))
            assert len(packet.count) == len(packet.depth) == n
            assert set(packet.count.tolist()) == {number}
            assert len(packet.front) == (n + 1 if takes_along else 0)
            for array in (packet.geometry, packet.cursor, packet.value, packet.carry):
                assert len(array) == n + 1
        assert seen.max() == 1
        assert seen.sum() == region.pixels
        assert seen[region.rows, region.columns].all()


def test_what_is_drawn_at_once_leaves_nothing() -> None:
    def draw_all(*_: object) -> tuple[int, int, int]:
        return 0, 77, 5

    strip = draw(draw_all, Region(0, 0, 30, 9), along=False)
    assert not strip.packets
    assert (strip.fresh, strip.early) == (77, 5)
