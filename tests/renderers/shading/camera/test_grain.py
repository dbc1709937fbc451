import numpy as np
import pytest

from renderers.shading.camera.grain import SIDE, grain_offset, grain_tile


def test_grain_has_unit_deviation_and_no_mean() -> None:
    grain = grain_tile(1)
    assert grain.shape == (3, SIDE, SIDE)
    assert float(grain.std()) == pytest.approx(1, abs=1e-5)
    assert abs(float(grain.mean())) < 0.01


def test_neighbours_are_alike_across_the_edges_of_the_tile_too() -> None:
    grain = grain_tile(2)
    for axis in (1, 2):
        product = grain * np.roll(grain, 1, axis=axis)
        inside = float(product.mean())
        edge = float(product.take(0, axis=axis).mean())
        assert 0.1 < inside < 0.6
        assert edge == pytest.approx(inside, abs=0.15)


def test_seeds_give_other_grain_and_colours_are_independent() -> None:
    assert not np.array_equal(grain_tile(1), grain_tile(3))
    red, green, blue = grain_tile(1).reshape(3, -1)
    for a, b in ((red, green), (green, blue), (blue, red)):
        assert abs(float(np.mean(a * b))) < 0.02


def test_offsets_are_spread_over_the_tile() -> None:
    offsets = [grain_offset(n) for n in range(400)]
    assert all(0 <= row < SIDE and 0 <= column < SIDE for row, column in offsets)
    assert len(set(offsets)) > 390
    quarters = [(4 * row // SIDE, 4 * column // SIDE) for row, column in offsets]
    assert min(quarters.count((i, j)) for i in range(4) for j in range(4)) > 8
