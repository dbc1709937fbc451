import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer
from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.field_reads import DistanceField, tap
from renderers.shading.kernels.virtual_lights import (
    PLANES,
    gather_lights,
    lift,
    spread_grid,
    trace_lights,
)
from tests.renderers.shading.plain_normal import plain_normal

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


def test_no_lights_no_bounce(gbuffer: GBuffer, camera: Camera) -> None:
    assert not gathered(gbuffer, camera, lights(0))[0].any()


def lifted(
    w: NDArray[np.float32], grid: NDArray[np.float32], y0: int
) -> NDArray[np.float64]:
    """Lift a block in columns 16 to 31 of rows y0 to y0 + 3; give it as rows."""
    spread = np.full((2, PLANES, 70), np.nan, np.float32)
    spread_grid(grid, y0 // b.CELL, spread)
    lift(w, spread, y0, 16)
    return w[b.BOUNCE : b.BOUNCE + b.N].reshape(b.ROWS, b.W).astype(np.float64)


def plane(depth: float) -> NDArray[np.float32]:
    w = np.zeros(b.SLOTS, np.float32)
    w[b.T : b.T + b.N] = depth
    w[b.NX : b.NX + b.N] = 1
    return w


def test_the_grid_is_spread_over_its_cells() -> None:
    grid = np.random.default_rng(0).random((PLANES, 4, 5)).astype(np.float32)
    spread = np.zeros((2, PLANES, 60), np.float32)
    spread_grid(grid, 2, spread)
    for j in range(2):
        expected = np.repeat(grid[:, 2 + j], 8, axis=1)
        assert_array_equal(spread[j, :, :40], expected)
        # beyond the last point, the last point
        assert_array_equal(spread[j, :, 40:], np.repeat(expected[:, -1:], 20, 1))


def test_lifting_a_constant_gives_the_constant() -> None:
    # whatever normals and depths do to the weights, they sum to one
    rng = np.random.default_rng(1)
    grid = np.empty((5, 4, 10), np.float32)
    grid[0] = 0.7
    normal = rng.normal(size=(3, 4, 10))
    grid[1:4] = normal / np.linalg.norm(normal, axis=0)
    grid[4] = rng.uniform(2, 20, (4, 10))
    w = plane(1)
    w[b.T : b.T + b.N] = rng.uniform(2, 20, b.N)
    # but for a share of 1e-6 that keeps them from vanishing
    np.testing.assert_allclose(lifted(w, grid, 12), 0.7, rtol=0.03)


def test_lifting_one_plane_is_bilinear() -> None:
    grid = np.zeros((5, 4, 10), np.float32)
    grid[0] = np.arange(40).reshape(4, 10)
    grid[1] = 1
    grid[4] = 5
    for y0 in (8, 12):
        x, y = np.meshgrid(np.arange(16, 32), np.arange(y0, y0 + 4))
        # the floor of 1e-5 under every weight lets a trace of the other corners in
        np.testing.assert_allclose(
            lifted(plane(5), grid, y0), x / 8 + 10 * y / 8, rtol=2e-4, atol=1e-3
        )


def test_lifting_is_joint_bilateral() -> None:
    rng = np.random.default_rng(3)
    grid = rng.random((5, 3, 10)).astype(np.float32)
    normal = rng.normal(size=(3, 3, 10))
    grid[1:4] = normal / np.linalg.norm(normal, axis=0)
    grid[4] = rng.uniform(4, 6, (3, 10))
    w = np.zeros(b.SLOTS, np.float32)
    depth = rng.uniform(4, 6, b.N).astype(np.float32)
    normal = rng.normal(size=(3, b.N))
    normal /= np.linalg.norm(normal, axis=0)
    w[b.T : b.T + b.N] = depth
    w[b.NX : b.NX + 3 * b.N] = normal.reshape(-1)
    got = lifted(w, grid, 4).reshape(-1)
    for i in range(b.N):
        x, y = 16 + i % b.W, 4 + i // b.W
        total, weight = 0.0, 1e-6
        for right, below in ((0, 0), (1, 0), (0, 1), (1, 1)):
            e, *n, t = grid[:, y // 8 + below, x // 8 + right].astype(np.float64)
            share = abs(1 - right - x % 8 / 8) * abs(1 - below - y % 8 / 8)
            same = max(float(np.dot(n, normal[:, i])), 0) ** 4 + 1e-3
            apart = (t - float(depth[i])) / float(depth[i])
            q = share * same / (1 + 400 * apart**2) + 1e-5
            total, weight = total + q * e, weight + q
        assert abs(got[i] - total / weight) < 2e-5


def test_unseen_grid_points_do_not_count() -> None:
    grid = np.zeros((5, 3, 10), np.float32)
    grid[0] = 1e6
    grid[0, :, 2] = 2
    grid[1] = 1
    grid[4, :, 2] = 5
    got = lifted(plane(5), grid, 0)
    # the seen points are column 16's: cells to the left of 24 reach them
    np.testing.assert_allclose(got[:, :8], 2, rtol=0.02)
    assert not got[:, 8:].any()


def test_a_tap_of_a_linear_field_is_exact_and_clamps() -> None:
    k, j, i = np.meshgrid(*(np.arange(n) for n in (4, 5, 6)), indexing="ij")
    values = (i + 10 * j + 100 * k).astype(np.float32)
    np.testing.assert_allclose(
        tap(values, f32(2.25), f32(1.5), f32(0.75)), 2.25 + 15 + 75, rtol=1e-6
    )
    np.testing.assert_allclose(tap(values, f32(-9), f32(-9), f32(99)), 300, atol=0.2)


def traced(
    distance: NDArray[np.float32],
    m: NDArray[np.float32],
    eye: NDArray[np.float32],
    ray: NDArray[np.float32],
    longest: np.float32,
    limit: int,
) -> NDArray[np.float32] | None:
    """Follow one ray; give place and normal of its wall."""
    top = np.array(distance.shape[::-1], np.float32) - f32(1)
    v = [f32(r[0] * ray[0] + r[1] * ray[1] + r[2] * ray[2]) for r in m]
    t = f32(0)
    for _ in range(limit):
        x, y, z = (eye[i] + t * v[i] for i in range(3))
        if not all(0 <= p <= end for p, end in zip((x, y, z), top, strict=True)):
            return None
        d = tap(distance, x, y, z)
        if d > f32(-0.04):
            normal = plain_normal(distance, m, x, y, z)
            return np.array([t * ray[0], t * ray[1], t * ray[2], *normal], np.float32)
        t += max(f32(-0.95) * d, f32(0.05))
        if t >= longest:
            return None
    return None


@settings(deadline=None, max_examples=25)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 50),
    longest=st.floats(0.5, 20, width=32),
    limit=st.integers(1, 40),
)
def test_rays_arrive_together_as_they_do_alone(
    seed: int, count: int, longest: float, limit: int
) -> None:
    random = np.random.default_rng(seed)
    # walls near and far, openings, and rays that run out of steps or of room
    noise = random.standard_normal((12, 15, 13)) - random.uniform(0, 3)
    distance = noise.astype(np.float32)
    m = (random.standard_normal((3, 3)) + 2 * np.eye(3)).astype(np.float32)
    eye = random.uniform(3, 9, 3).astype(np.float32)
    rays = random.standard_normal((3, count)).astype(np.float32)
    rays /= np.linalg.norm(rays, axis=0)
    flux = random.random(count).astype(np.float32)
    table = np.zeros((8, count), np.float32)
    arrived = trace_lights(
        DistanceField(distance, m, eye), rays, flux, f32(longest), limit, table
    )
    alone = [traced(distance, m, eye, ray, f32(longest), limit) for ray in rays.T]
    kept = [i for i, found in enumerate(alone) if found is not None]
    assert arrived == len(kept)
    for column, i in enumerate(kept):
        assert_array_equal(table[:6, column], alone[i])
        assert table[6, column] == flux[i]
    assert not table[:, arrived:].any()
