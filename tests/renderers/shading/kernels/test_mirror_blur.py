"""What ground metal mirrors is evened out on the metal, and there alone."""

import numpy as np

from renderers.shading.kernels.indirect import METAL
from renderers.shading.kernels.mirror_blur import blur_rows


def test_the_blur_keeps_even_light_and_stays_on_the_metal() -> None:
    size, stride = 64, 8
    depth = np.full((size, size), 10, np.float32)
    normal = np.zeros((size, size, 3), np.float32)
    normal[..., 2] = -1
    material = np.zeros((size, size), np.uint8)
    material[:, 24:] = METAL
    lattice = np.zeros((10, 10, 6), np.float32)
    lattice[:, 3:, :3] = 0.5
    lattice[:, :3] = 9.0
    blurred = np.empty_like(lattice)
    every = np.ones(lattice.shape[:2], np.bool_)
    for first, last in ((0, 4), (4, 10)):
        blur_rows(
            depth, normal, material, stride, 20, every, lattice, blurred, first, last
        )
    np.testing.assert_allclose(blurred[:, 3:, :3], 0.5, rtol=1e-6)
    np.testing.assert_array_equal(blurred[:, :3], lattice[:, :3])
