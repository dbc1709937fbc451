import math

import numpy as np
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer
from renderers.shading.kernels.field_reads import tap
from renderers.shading.kernels.virtual_lights import gather_lights

f32 = np.float32


def lights(count: int) -> NDArray[np.float32]:
    rng = np.random.default_rng(7)
    table = rng.normal(size=(8, count)) * 4
    table[3:6] /= np.linalg.norm(table[3:6], axis=0)
    table[6] = rng.random(count)
    table[7] = 1 + rng.random(count)
    return table.astype(np.float32)


def gathered(
    buffer: GBuffer, camera: Camera, table: NDArray[np.float32]
) -> NDArray[np.float32]:
    height, width = buffer.size
    grid = np.full((5, height // 8 + 2, width // 8 + 2), np.nan, np.float32)
    gather_lights(
        buffer.depth_mm,
        buffer.normal,
        buffer.coverage,
        camera.lens_table(),
        camera.frame[1:].astype(np.float32),
        table,
        table.shape[1],
        8,
        np.ones(grid.shape[1:], np.bool_),
        grid,
        0,
        grid.shape[1],
    )
    return grid


def test_the_gather_is_the_sum_it_says(gbuffer: GBuffer, camera: Camera) -> None:
    table = lights(37)
    grid = gathered(gbuffer, camera, table)
    _, rays = camera.rays()
    position, normal = table[:3].T.astype(np.float64), table[3:6].T
    for (j, i), value in np.ndenumerate(grid[0]):
        y, x = min(8 * j, camera.height - 1), min(8 * i, camera.width - 1)
        if gbuffer.coverage[y, x] == 0:
            assert grid[4, j, i] == 0
            continue
        d = position - gbuffer.depth_mm[y, x] * rays[y, x]
        receive = np.maximum(d @ gbuffer.normal[y, x], 0)
        emit = np.maximum(-(d * normal).sum(axis=1), 0)
        d2 = (d * d).sum(axis=1) + table[7]
        expected = (table[6] * receive * emit / d2**2).sum() / math.pi
        np.testing.assert_allclose(value, expected, rtol=2e-5, atol=1e-8)
        assert grid[4, j, i] == gbuffer.depth_mm[y, x]
        assert_array_equal(grid[1:4, j, i], gbuffer.normal[y, x])


def test_a_tap_of_a_linear_field_is_exact_and_clamps() -> None:
    k, j, i = np.meshgrid(*(np.arange(n) for n in (4, 5, 6)), indexing="ij")
    values = (i + 10 * j + 100 * k).astype(np.float32)
    np.testing.assert_allclose(
        tap(values, f32(2.25), f32(1.5), f32(0.75)), 2.25 + 15 + 75, rtol=1e-6
    )
    np.testing.assert_allclose(tap(values, f32(-9), f32(-9), f32(99)), 300, atol=0.2)
