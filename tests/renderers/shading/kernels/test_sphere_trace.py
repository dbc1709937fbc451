"""Rays followed sixteen at a time find what each finds alone."""

import numpy as np
import pytest

from renderers.shading.kernels.field_reads import DistanceField
from renderers.shading.kernels.path_tracing import sphere_trace
from renderers.shading.kernels.sphere_trace import sphere_trace_rays

f32 = np.float32


@pytest.mark.parametrize(("many", "longest"), [(1, 60), (16, 60), (700, 60), (300, 4)])
def test_rays_side_by_side_find_what_each_finds_alone(
    many: int, longest: float
) -> None:
    """To the bit: in a cave of waves, from inside, from its walls and from without.

    Some leave the grid, some go too far, some slide along a wall until they give up.
    """
    z, y, x = np.indices((26, 30, 34)).astype(np.float32)
    waves = np.sin(0.5 * x) + np.sin(0.6 * y + 1) + np.sin(0.45 * z + 2)
    field = (0.8 * waves - 0.4).astype(np.float32)
    # a slit so thin that rays along it make the smallest of steps
    field[12:14] = -0.005
    turn = np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]])
    m = (1.7 * turn).astype(np.float32)
    eye = np.array([16.0, 14.0, 12.5], np.float32)
    rng = np.random.default_rng(many)
    rays = np.zeros((many, 8), np.float32)
    rays[:, :3] = rng.uniform(-9, 9, (many, 3))
    rays[: many // 4, 2] = 0
    ways = rng.standard_normal((many, 3))
    ways[: many // 8, 2] = 0
    rays[:, 3:6] = ways / np.linalg.norm(ways, axis=1)[:, None]
    found = np.full((many + 1, 4), 7, np.float32)
    seen = DistanceField(field, m, eye)
    sphere_trace_rays(seen, rays, f32(longest), found)
    for ray, way in zip(rays, found, strict=False):
        a, b, c, d, e, f = (f32(n) for n in ray[:6])
        expected = sphere_trace(seen, (a, b, c), (d, e, f), f32(longest))
        assert f32(expected).tobytes() == way[0].tobytes()
    if many > 100:
        assert (found[:many, 0] >= 0).any()
        assert (found[:many, 0] < 0).any()


def test_no_rays_find_nothing() -> None:
    field = np.zeros((4, 4, 4), np.float32)
    found = np.full((1, 4), 7, np.float32)
    m, eye = np.eye(3, dtype=np.float32), np.ones(3, np.float32)
    seen = DistanceField(field, m, eye)
    sphere_trace_rays(seen, np.zeros((0, 8), np.float32), f32(9), found)
    assert (found == 7).all()
