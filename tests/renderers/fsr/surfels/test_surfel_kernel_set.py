"""Vector kernels and their scalar twin draw the same bits."""

import numpy as np
import pytest

from renderers import simd_guard
from renderers.fsr.surfels import SurfelRasterizer
from renderers.fsr.surfels.surfel_kernel_set import (
    KernelSet,
    best_kernels,
    scalar_kernels,
)
from renderers.scene import Camera, Projection, Volume
from renderers.scene.thread_team import ThreadTeam

VIEWS = [
    ((-6.5, -0.4, 0.3), (5.0, 0.0, 0.0), (150, 101)),
    ((-4.5, 0.3, 0.2), (5.0, 6.0, 2.0), (64, 64)),
    ((6.2, 0.1, -0.3), (-5.0, 0.4, 0.0), (67, 130)),
    ((-11.5, 0.0, 0.0), (-14.0, 0.5, 0.0), (96, 95)),  # 0.25 mm from the wall
    ((0.0, 30.0, 0.0), (0.0, 0.0, 0.0), (80, 60)),  # from outside: open air
]


# slow to compile; live pictures need vectors for their light anyway
@pytest.mark.slow
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
    assert best.draw_tiles is not scalar.draw_tiles, "vectors run here"
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


@pytest.mark.parametrize("kernels", [best_kernels(), scalar_kernels()])
@pytest.mark.parametrize("refresh", [1, 7, 1 << 30])
def test_leaving_out_what_is_behind_changes_no_bit(
    cavities: Volume,
    team: ThreadTeam,
    monkeypatch: pytest.MonkeyPatch,
    kernels: KernelSet,
    refresh: int,
) -> None:
    """However often tiles look what is hidden by now, or never, and over all views."""
    rasterizer = SurfelRasterizer(cavities, kernels=kernels)
    rng = np.random.default_rng(5)
    for eye, target, (width, height) in VIEWS[:3]:
        towards = np.array(target) + rng.normal(size=3)
        # few pixels: discs that are barely one wide are left out and met at random
        camera = Camera.looking_at(eye, towards, size=(width // 3, height // 3))
        usual = rasterizer.draw(camera, team)
        monkeypatch.setattr("renderers.fsr.surfels.surfel_rasterizer.REFRESH", refresh)
        other = rasterizer.draw(camera, team)
        monkeypatch.undo()
        for name in ("depth_mm", "normal", "coverage"):
            np.testing.assert_array_equal(getattr(usual, name), getattr(other, name))


def test_scalars_serve_where_vectors_do_not_compile(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "renderers.fsr.surfels.surfel_kernel_set.vector_problem", lambda: "changed"
    )
    assert simd_guard.vector_problem() == ""
    assert best_kernels() == scalar_kernels()
