from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.splats.screen_bands import SNAP, ScreenBands


@given(
    down=st.integers(1, 20),
    across=st.integers(1, 20),
    count=st.integers(1, 9),
    seconds=st.lists(st.lists(st.floats(0, 1e3), min_size=9, max_size=9), max_size=5),
)
def test_bands_are_all_tiles_once_whatever_was_learnt(
    down: int, across: int, count: int, seconds: list[list[float]]
) -> None:
    bands = ScreenBands()
    for told in [*seconds, [0.0] * 9]:
        cut = bands.cut(down, across, count)
        assert len(cut) == min(count, down * across)
        assert [tile for band in cut for tile in band] == list(range(down * across))
        assert all(len(band) > 0 for band in cut)
        bands.learn(cut, told[: len(cut)])


def cost(bands: Sequence[range], tiles: Sequence[float]) -> list[float]:
    """Give the seconds that bands take whose tiles cost so much."""
    return [sum(tiles[band.start : band.stop]) for band in bands]


@pytest.mark.parametrize("count", [2, 3, 5])
def test_bands_come_to_take_equally_long(count: int) -> None:
    tiles = [9.0 if 45 <= tile < 90 else 1.0 for tile in range(16 * 15)]
    bands = ScreenBands()
    first = cost(bands.cut(16, 15, count), tiles)
    for _ in range(40):
        cut = bands.cut(16, 15, count)
        bands.learn(cut, cost(cut, tiles))
    last = cost(bands.cut(16, 15, count), tiles)
    assert max(first) > 1.3 * sum(tiles) / count
    # a cut may be moved to the end of its row, and to a whole tile
    assert max(last) < sum(tiles) / count + 9.0 * (15 * SNAP + 1)


def test_one_late_picture_hardly_moves_the_cuts() -> None:
    bands = ScreenBands()
    before = bands.cut(16, 16, 2)
    bands.learn(before, [1.0, 1000.0])
    after = bands.cut(16, 16, 2)
    assert 0 < abs(after[0].stop - before[0].stop) <= 8


def test_other_pictures_begin_anew_and_old_bands_are_not_learnt_from() -> None:
    bands = ScreenBands()
    small = bands.cut(4, 4, 2)
    large = bands.cut(8, 8, 2)
    bands.learn(small, [1.0, 9.0])
    assert bands.cut(8, 8, 2) == large
    assert bands.cut(4, 4, 1) == (range(16),)


@pytest.mark.parametrize(("told", "end"), [(0.93, 20), (0.6, 17), (1.0, 20)])
def test_a_cut_near_the_end_of_a_row_is_put_there(told: float, end: int) -> None:
    """From 20 of 40 tiles in rows of ten, moved by a part of one tile or more."""
    bands = ScreenBands()
    cut = bands.cut(4, 10, 2)
    for _ in range(3):
        bands.learn(cut, [1.0, told])
    assert bands.cut(4, 10, 2)[0].stop == end
