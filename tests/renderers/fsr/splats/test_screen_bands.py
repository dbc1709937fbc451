from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.splats.screen_bands import SNAP, Strips


@given(
    down=st.integers(1, 20),
    across=st.integers(1, 20),
    count=st.integers(1, 9),
    seconds=st.lists(st.lists(st.floats(0, 1e3), min_size=9, max_size=9), max_size=5),
)
def test_strips_are_all_tiles_once_whatever_was_learnt(
    down: int, across: int, count: int, seconds: list[list[float]]
) -> None:
    strips = Strips()
    for told in [*seconds, [0.0] * 9]:
        cut = strips.cut(down, across, count)
        assert len(cut) == min(count, down * across)
        assert [tile for strip in cut for tile in strip] == list(range(down * across))
        assert all(len(strip) > 0 for strip in cut)
        strips.learn(cut, told[: len(cut)])


def cost(strips: Sequence[range], tiles: Sequence[float]) -> list[float]:
    """Give the seconds that strips take whose tiles cost so much."""
    return [sum(tiles[strip.start : strip.stop]) for strip in strips]


@pytest.mark.parametrize("count", [2, 3, 5])
def test_strips_come_to_take_equally_long(count: int) -> None:
    tiles = [9.0 if 45 <= tile < 90 else 1.0 for tile in range(16 * 15)]
    strips = Strips()
    first = cost(strips.cut(16, 15, count), tiles)
    for _ in range(40):
        cut = strips.cut(16, 15, count)
        strips.learn(cut, cost(cut, tiles))
    last = cost(strips.cut(16, 15, count), tiles)
    assert max(first) > 1.3 * sum(tiles) / count
    # a cut may be moved to the end of its row, and to a whole tile
    assert max(last) < sum(tiles) / count + 9.0 * (15 * SNAP + 1)


def test_one_late_picture_hardly_moves_the_cuts() -> None:
    strips = Strips()
    before = strips.cut(16, 16, 2)
    strips.learn(before, [1.0, 1000.0])
    after = strips.cut(16, 16, 2)
    assert 0 < abs(after[0].stop - before[0].stop) <= 8


def test_other_pictures_begin_anew_and_old_strips_are_not_learnt_from() -> None:
    strips = Strips()
    small = strips.cut(4, 4, 2)
    large = strips.cut(8, 8, 2)
    strips.learn(small, [1.0, 9.0])
    assert strips.cut(8, 8, 2) == large
    assert strips.cut(4, 4, 1) == (range(16),)


@pytest.mark.parametrize(("told", "end"), [(0.93, 20), (0.6, 17), (1.0, 20)])
def test_a_cut_near_the_end_of_a_row_is_put_there(told: float, end: int) -> None:
    """From 20 of 40 tiles in rows of ten, moved by a part of one tile or more."""
    strips = Strips()
    cut = strips.cut(4, 10, 2)
    for _ in range(3):
        strips.learn(cut, [1.0, told])
    assert strips.cut(4, 10, 2)[0].stop == end
