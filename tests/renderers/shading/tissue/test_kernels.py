import numpy as np
from numpy.testing import assert_array_equal

from renderers.scene import Material
from renderers.shading.materials import SURFACES, material_table
from renderers.shading.surface import block as b
from renderers.shading.tissue.kernels import set_materials, tint_at

f32 = np.float32


def test_tint_is_the_volumes_own_interpolation() -> None:
    rng = np.random.default_rng(0)
    shape = (4, 5, 6)
    blood = rng.integers(0, 256, shape)
    skin = rng.integers(0, 256, shape)
    tint = (blood + 256 * skin).astype(np.uint16).reshape(-1)
    for _ in range(30):
        x, y, z = (float(rng.uniform(0, n - 1.01)) for n in shape[::-1])
        got = tint_at(tint, shape, f32(x), f32(y), f32(z))
        i, j, k = int(x), int(y), int(z)
        for channel, values in enumerate((blood, skin)):
            expected = 0.0
            for corner in range(8):
                p, q, r = corner & 1, corner >> 1 & 1, corner >> 2
                weight = (
                    (x - i if p else 1 - x + i)
                    * (y - j if q else 1 - y + j)
                    * (z - k if r else 1 - z + k)
                )
                expected += weight * values[k + r, j + q, i + p]
            np.testing.assert_allclose(got[channel], expected, atol=1e-3)


def test_tint_outside_the_grid_is_that_of_its_edge() -> None:
    tint = np.arange(64, dtype=np.uint16)
    inside = tint_at(tint, (4, 4, 4), f32(0), f32(0), f32(0))
    assert tint_at(tint, (4, 4, 4), f32(-50), f32(-1), f32(-0.1)) == inside
    far = tint_at(tint, (4, 4, 4), f32(99), f32(99), f32(99))
    np.testing.assert_allclose(far[0], 63, atol=0.05)


def test_materials_reach_their_pixels() -> None:
    w = np.full(b.SLOTS, np.nan, np.float32)
    material = np.zeros((2, 80), np.uint8)
    material[1, 70:77] = np.arange(7)
    set_materials(w, material, 1, 64, 16, material_table())
    for i in range(16):
        surface = SURFACES[Material(int(material[1, 64 + i]))]
        assert w[b.SHARE + i] == f32(surface.tissue)
        assert w[b.ADD_RED + i] == f32(surface.red)
        assert w[b.F0 + i] == f32(surface.f0)
        assert w[b.RELIEF + i] == f32(surface.relief)
    # what the picture does not reach is tissue, hence finite
    assert_array_equal(w[b.SHARE + 16 : b.SHARE + b.N], f32(1))
