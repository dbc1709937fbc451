"""Vector kernels and their scalar twin draw the same bits."""

import numpy as np
import pytest

from renderers import simd_guard
from renderers.fsr.scope import SurfelRasterizer
from renderers.fsr.scope.kernel_set import best_kernels, scalar_kernels
from renderers.fsr.thread_team import ThreadTeam
from renderers.scene import Camera, Projection, Volume

VIEWS = [
    ((-6.5, -0.4, 0.3), (5.0, 0.0, 0.0), (150, 101)),
    ((-4.5, 0.3, 0.2), (5.0, 6.0, 2.0), (64, 64)),
    ((6.2, 0.1, -0.3), (-5.0, 0.4, 0.0), (67, 130)),
    ((-11.5, 0.0, 0.0), (-14.0, 0.5, 0.0), (96, 95)),  # 0.25 mm from the wall
    ((0.0, 30.0, 0.0), (0.0, 0.0, 0.0), (80, 60)),  # from outside: open air
]


@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
@pytest.mark.parametrize(("eye", "target", "size"), VIEWS)
def test_vectors_and_scalars_give_equal_bits(
    cavities: Volume,
    team: ThreadTeam,
    projection: Projection,
    eye: tuple[float, float, float],
    target: tuple[float, float, float],
    size: tuple[int, int],
) -> None:
    camera = Camera.looking_at(eye, target, size=size, projection=projection)
    best, scalar = best_kernels(), scalar_kernels()
    assert best.draw_tile is not scalar.draw_tile, "vectors run here"
    drawn = []
    for kernels in (best, scalar):
        rasterizer = SurfelRasterizer(cavities, kernels=kernels)
        g = rasterizer.draw(camera, team)
        drawn.append((g, rasterizer.counters))
    (a, told), (b, told_twin) = drawn
    assert told == told_twin
    for name in ("depth_mm", "normal", "coverage"):
        bits = (getattr(g, name).view(np.uint32) for g in (a, b))
        np.testing.assert_array_equal(*bits)


def test_scalars_serve_where_vectors_do_not_compile(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "renderers.fsr.scope.kernel_set.vector_problem", lambda: "changed"
    )
    assert simd_guard.vector_problem() == ""
    assert best_kernels() == scalar_kernels()
