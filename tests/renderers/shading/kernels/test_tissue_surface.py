import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.scene import Material
from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.tissue_surface import (
    colour,
    mix,
    set_materials,
    set_tissue,
    tint_at,
)
from renderers.shading.materials import SURFACES, material_table
from renderers.shading.surface_look import rows_of_eight
from renderers.shading.tissue_colour import colour_table

f32 = np.float32


def tint_of(
    tint: NDArray[np.uint16],
    shape: tuple[int, int, int],
    points: NDArray[np.float64],
) -> tuple[NDArray[np.float32], bool]:
    """Give blood and skin codes at up to a block's voxel coordinates (x, y, z)."""
    w = np.zeros(b.SLOTS, np.float32)
    for slot, values in zip((b.UX, b.UY, b.UZ), points.T, strict=True):
        w[slot : slot + len(points)] = values
    skin = tint_at(w, tint, shape)
    codes = [w[slot : slot + len(points)] for slot in (b.CODE, b.SKIN)]
    return np.stack(codes, axis=-1), skin


def test_tint_is_the_volumes_own_interpolation() -> None:
    rng = np.random.default_rng(0)
    shape = (4, 5, 6)
    blood = rng.integers(0, 256, shape)
    skin = rng.integers(0, 256, shape)
    tint = (blood + 256 * skin).astype(np.uint16).reshape(-1)
    points = np.stack([rng.uniform(0, n - 1.01, b.N) for n in shape[::-1]], -1)
    points = points.astype(np.float32).astype(np.float64)
    got, has_skin = tint_of(tint, shape, points)
    assert has_skin
    low = points.astype(int)
    part = points - low
    for channel, values in enumerate((blood, skin)):
        expected = np.zeros(b.N)
        for corner in range(8):
            step = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
            weight = np.where(step, part, 1 - part).prod(axis=1)
            i, j, k = (low + step).T
            expected += weight * values[k, j, i]
        np.testing.assert_allclose(got[:, channel], expected, atol=1e-3)


def test_tint_outside_the_grid_is_that_of_its_edge() -> None:
    tint = np.arange(64, dtype=np.uint16)
    points = np.array([[0, 0, 0], [-50, -1, -0.1], [99, 99, 99]])
    got, _ = tint_of(tint, (4, 4, 4), points)
    assert_array_equal(got[0], got[1])
    np.testing.assert_allclose(got[2, 0], 63, atol=0.05)


def test_tissue_without_skin_says_so() -> None:
    tint = np.full(64, 200, np.uint16)
    points = np.full((b.N, 3), 1.5)
    got, skin = tint_of(tint, (4, 4, 4), points)
    assert not skin
    assert_array_equal(got, np.broadcast_to([200, 0], got.shape))
    tint[63] += 256  # out of every point's reach, then within
    assert not tint_of(tint, (4, 4, 4), points)[1]
    points[17] = 2.5
    assert tint_of(tint, (4, 4, 4), points)[1]


@pytest.mark.parametrize("width", [77, 96])
def test_materials_reach_their_pixels(width: int) -> None:
    w = np.full(b.SLOTS, np.nan, np.float32)
    table = material_table()
    set_tissue(w, table)
    material = np.zeros((9, width), np.uint8)
    material[5, 70:77] = np.arange(7)
    material[8] = 2
    plain = w.copy()
    assert not set_materials(w, material, 0, 64, 0, 9, table, False)
    assert_array_equal(w, plain)
    assert set_materials(w, material, 4, 64, 0, 8, table, False)
    kinds = np.zeros(b.N, int)
    kinds[b.W + 6 : b.W + 13] = np.arange(7)
    for i, kind in enumerate(kinds):
        surface = SURFACES[Material(int(kind))]
        assert w[b.SHARE + i] == f32(surface.tissue)
        assert w[b.ADD_RED + i] == f32(surface.red)
        assert w[b.F0 + i] == f32(surface.f0)
        assert w[b.RELIEF + i] == f32(surface.relief)
        assert w[b.ROUGH + i] == f32(surface.alpha) * f32(surface.alpha)
    # a block after it is tissue again; rows outside the band do not count
    assert not set_materials(w, material, 8, 64, 0, 8, table, True)
    assert_array_equal(w, plain)


def test_colours_are_the_tables() -> None:
    table = colour_table()
    w = np.zeros(b.SLOTS, np.float32)
    codes = np.linspace(0, 255, b.N)
    w[b.CODE : b.CODE + b.N] = codes
    colour(w, rows_of_eight(table))
    for column, slot in enumerate((b.RED, b.GREEN, b.BLUE, b.LR, b.LG)):
        expected = np.interp(codes, np.arange(256), table[:, column])
        np.testing.assert_allclose(w[slot : slot + b.N], expected, rtol=1e-3)


def test_skin_and_materials_mix_by_their_shares() -> None:
    rng = np.random.default_rng(2)
    w = rng.random(b.SLOTS).astype(np.float32)
    before = w.astype(np.float64)
    skin_colour = np.array([0.5, 0.3, 0.2], np.float32)
    mix(w, skin_colour)

    def part(slot: int) -> NDArray[np.float64]:
        return before[slot : slot + b.N]

    for k, (slot, add) in enumerate(
        ((b.RED, b.ADD_RED), (b.GREEN, b.ADD_GREEN), (b.BLUE, b.ADD_BLUE))
    ):
        skin = part(b.SKIN)
        mixed = (1 - skin) * part(slot) + skin * float(skin_colour[k])
        expected = part(b.SHARE) * mixed + part(add)
        np.testing.assert_allclose(w[slot : slot + b.N], expected, rtol=1e-5)
    for slot, add in ((b.LR, b.ADD_LR), (b.LG, b.ADD_LG)):
        expected = part(b.SHARE) * part(slot) + part(add)
        np.testing.assert_allclose(w[slot : slot + b.N], expected, rtol=1e-5)
