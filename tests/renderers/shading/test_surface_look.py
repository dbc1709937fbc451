import numpy as np
from numpy.testing import assert_array_equal

from renderers.scene import AirSurface
from renderers.shading.surface_look import surface_tables, tint_of
from renderers.shading.tissue_colour import colour_table


def test_the_tint_is_blood_and_skin(surface: AirSurface) -> None:
    tint = tint_of(surface.blood.values, surface.skin.values)
    look = surface_tables(tint, 1, 1.0, True)
    assert_array_equal(look.tint & 255, surface.blood.values.reshape(-1))
    assert_array_equal(look.tint >> 8, surface.skin.values.reshape(-1))


def test_the_seed_decides_the_tiles(surface: AirSurface) -> None:
    tint = tint_of(surface.blood.values, surface.skin.values)
    a, b, c = (surface_tables(tint, seed, 1.0, True) for seed in (1, 1, 2))
    assert_array_equal(a.tile.quads, b.tile.quads)
    assert not np.array_equal(a.tile.quads, c.tile.quads)
    # vessels must not follow the mottle
    correlation = np.corrcoef(a.tile.quads[::4], a.vessel_tile.quads[::4])[0, 1]
    assert abs(float(correlation)) < 0.05


def test_heads_have_vessels_of_their_own(surface: AirSurface) -> None:
    """Below .2 between any two, also of seeds that follow one another."""
    tint = tint_of(surface.blood.values, surface.skin.values)
    tiles = [surface_tables(tint, seed, 1.0, True).vessel_tile for seed in range(1, 6)]
    found = np.corrcoef([tile.quads[::4] for tile in tiles])
    assert np.abs(found - np.eye(len(tiles))).max() < 0.2


def test_its_arrays_cannot_be_written(surface: AirSurface) -> None:
    tint = tint_of(surface.blood.values, surface.skin.values)
    look = surface_tables(tint, 1, 1.0, True)
    for name in ("tint", "colours", "skin", "materials", "to_tile"):
        assert not getattr(look, name).flags.writeable, name
    assert not look.tile.quads.flags.writeable
    rows = look.colours.reshape(-1, 8)
    assert_array_equal(rows[:, :5], colour_table())
    assert_array_equal(rows[:-1, 5], rows[1:, 4])
