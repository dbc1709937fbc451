"""Many places read a field as one does, to the bit."""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, sobel

from renderers.shading.kernels.field_reads import (
    DistanceField,
    is_outside,
    sobel_normal,
    taps,
    wall_normals,
)
from renderers.simd import load, select, store

f32 = np.float32
Floats = NDArray[np.float32]
W = 16


@njit(error_model="numpy")
def read(values: Floats, m: Floats, at: Floats, out: Floats) -> None:
    x, y, z = load(at, 0, W), load(at, W, W), load(at, 2 * W, W)
    d = taps(values, x, y, z)
    store(out, 0, d)
    nx, ny, nz = wall_normals(values, m, x, y, z)
    store(out, W, nx)
    store(out, 2 * W, ny)
    store(out, 3 * W, nz)
    outside = is_outside(values, x, y, z)
    store(out, 4 * W, select(outside, f32(1), f32(0) * d))


def test_a_paths_normal_is_sobels_gradient_between_grid_points() -> None:
    """As the ray tracer has it, by another program's filter; at the grid's edge too."""
    random = np.random.default_rng(4)
    values = random.standard_normal((6, 7, 8)).astype(np.float32)
    m = random.standard_normal((3, 3)).astype(np.float32)
    at = random.uniform(-0.5, 1.0, (60, 3)) * (8.5, 7.5, 6.5)
    at = np.clip(at, 0, (7, 6, 5)).astype(np.float32)
    slopes = [
        map_coordinates(sobel(values.astype(float), 2 - c), at.T[::-1], order=1)
        for c in range(3)
    ]
    expected = -np.stack(slopes, axis=1) @ m
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    field = DistanceField(values, m, np.zeros(3, np.float32))
    for place, normal in zip(at, expected, strict=True):
        np.testing.assert_allclose(sobel_normal(field, *place), normal, atol=2e-4)
