import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.view_bounds import tile_grid

size = st.integers(1, 4000)
side = st.integers(1, 130)


@given(height=size, width=size, tile=st.tuples(side, side))
def test_tiles_cover_a_picture_and_none_lies_beyond(
    height: int, width: int, tile: tuple[int, int]
) -> None:
    down, across = tile_grid(height, width, tile, 4000)
    assert (down - 1) * tile[0] < height <= down * tile[0]
    assert (across - 1) * tile[1] < width <= across * tile[1]


def test_a_picture_of_more_tiles_is_refused_by_its_size() -> None:
    assert tile_grid(510, 1020, (2, 4), 255) == (255, 255)
    for height, width in ((511, 1020), (510, 1021)):
        with pytest.raises(ValueError, match=f"1020 x 510 pixels, got {width} x"):
            tile_grid(height, width, (2, 4), 255)
