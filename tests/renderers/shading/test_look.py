import numpy as np
from numpy.testing import assert_array_equal

from renderers.scene import AirSurface
from renderers.shading import Detail
from renderers.shading.bands import RowBands
from renderers.shading.look import Look
from renderers.shading.tissue_colour import colour_table


def test_full_detail_leaves_the_tint_as_it_is(surface: AirSurface) -> None:
    look = Look.of(surface, Detail.FULL, 1, RowBands(1))
    assert_array_equal(look.tint & 255, surface.blood.values.reshape(-1))
    assert_array_equal(look.tint >> 8, surface.skin.values.reshape(-1))


def test_baking_does_not_depend_on_threads_and_spares_what_is_deep(
    surface: AirSurface,
) -> None:
    alone = Look.of(surface, Detail.BAKED, 1, RowBands(1))
    shared = Look.of(surface, Detail.BAKED, 1, RowBands(3))
    assert_array_equal(alone.tint, shared.tint)
    changed = (alone.tint & 255) != surface.blood.values.reshape(-1)
    distance = np.abs(surface.distance.values.reshape(-1))
    assert changed.any()
    assert float(distance[changed].max()) < 1.5
    # mottle is even-handed in the logarithm of blood
    near = changed & (surface.blood.values.reshape(-1) > 0)
    old = surface.blood.values.reshape(-1)[near].astype(np.float64)
    ratio = np.log((alone.tint & 255)[near] / old)
    assert abs(float(ratio.mean())) < 0.05
    assert 0.05 < float(ratio.std()) < 0.25


def test_its_arrays_cannot_be_written(surface: AirSurface) -> None:
    look = Look.of(surface, Detail.FULL, 1, RowBands(1))
    for name in ("tint", "colours", "skin", "materials", "tile", "to_tile"):
        assert not getattr(look, name).flags.writeable, name
    rows = look.colours.reshape(-1, 8)
    assert_array_equal(rows[:, :5], colour_table())
