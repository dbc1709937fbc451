"""Vector kernels and their scalar twin draw the same bits."""

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers import simd_guard
from renderers.fsr import Inclusion, extract_fuzzy_set
from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.fsr.splats.splat_kernel_set import best_kernels, scalar_kernels
from renderers.scene import Camera, Projection, Scene, TransferFunction, Volume
from renderers.scene.thread_team import ThreadTeam

VIEWS = [
    ((5.0, -12.0, 6.0), (71, 50), {0: 0.7, 1: 0.7, 2: 7.0}),
    ((5.2, 4.9, 4.1), (64, 67), {0: 0.9, 1: 0.8, 2: 3.0}),  # among the splats
]


def cloud() -> Scene:
    rng = np.random.default_rng(11)
    volume = Volume(
        rng.uniform(0, 120, (9, 10, 11)).astype(np.float32),
        np.array([1.0, 0.8, 1.3]),
        np.zeros(3),
    )
    transfer = TransferFunction(
        np.array([0.0, 50.0, 200.0]),
        np.array([[0.8, 0.6, 0.4], [0.1, 0.9, 0.3], [0.5, 0.5, 1.0]]),
        np.array([0.0, 0.7, 2.0]),
    )
    return Scene(volume, transfer)


def limits(height: int, width: int) -> NDArray[np.float32]:
    """Give a plate in front of the left half of the picture."""
    limit = np.full((height, width), np.inf, np.float32)
    limit[5:40, : width // 2] = 15.0
    return limit


@pytest.mark.parametrize("mode", SplatMode)
@pytest.mark.parametrize("projection", Projection)
@pytest.mark.parametrize(("eye", "size", "extent"), VIEWS)
def test_vectors_and_scalars_give_equal_bits(
    team: ThreadTeam,
    eye: tuple[float, float, float],
    size: tuple[int, int],
    extent: dict[int, float],
    projection: Projection,
    mode: SplatMode,
) -> None:
    scene = cloud()
    fuzzy = extract_fuzzy_set(scene.volume, Inclusion.density(0, 120), 40.0)
    camera = Camera.looking_at(
        eye, (5, 5, 4), extent=extent[projection], size=size, projection=projection
    )
    best, scalar = best_kernels(), scalar_kernels()
    assert best.draw_pieces is not scalar.draw_pieces, "vectors run here"
    for limit in (None, limits(size[1], size[0])):
        a, b = (
            SplatRasterizer(fuzzy, scene, kernels=kernels).draw(
                camera, team, mode, with_depth=True, limit_mm=limit
            )
            for kernels in (best, scalar)
        )
        assert a.rgba[..., 3].max() > 0.5
        np.testing.assert_array_equal(a.rgba.view(np.uint32), b.rgba.view(np.uint32))
        assert a.depth_mm is not None
        assert b.depth_mm is not None
        np.testing.assert_array_equal(a.depth_mm, b.depth_mm)


@pytest.mark.parametrize("thin_mm", [0.5, 0.02, 1e-4])
@pytest.mark.parametrize("roll", [0.0, 0.3, 0.9, 1.5])
def test_leaving_squares_out_that_needles_miss_changes_no_bit(
    team: ThreadTeam, thin_mm: float, roll: float
) -> None:
    """Flat voxels on edge, hundreds of pixels long and a few wide, at any slant."""
    rng = np.random.default_rng(5)
    values = rng.uniform(60, 120, (4, 4, 5)).astype(np.float32)
    spacing = np.array([1.0, 0.9, thin_mm])
    volume = Volume(values, spacing, -spacing * [2.0, 1.5, 1.5])
    transfer = TransferFunction(
        np.array([0.0, 200.0]), np.ones((2, 3)), np.array([0.0, 0.5])
    )
    scene = Scene(volume, transfer)
    fuzzy = extract_fuzzy_set(volume, Inclusion.density(0, 120), 50.0)
    camera = Camera.looking_at(
        (1.0, -20.0, 0.01),
        (0, 0, 0),
        up=(np.sin(roll), 0.0, np.cos(roll)),
        extent=2.5,
        size=(230, 190),
        projection=Projection.ORTHOGRAPHIC,
    )
    a, b = (
        SplatRasterizer(fuzzy, scene, kernels=kernels).draw(camera, team).rgba
        for kernels in (best_kernels(), scalar_kernels())
    )
    assert a[..., 3].max() > 0
    np.testing.assert_array_equal(a.view(np.uint32), b.view(np.uint32))


def test_scalars_serve_where_vectors_do_not_compile(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "renderers.fsr.splats.splat_kernel_set.vector_problem", lambda: "changed"
    )
    assert simd_guard.vector_problem() == ""
    assert best_kernels() == scalar_kernels()
