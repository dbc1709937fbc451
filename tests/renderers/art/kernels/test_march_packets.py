"""Packets draw what the scalar march draws, bit by bit."""

import numpy as np
import pytest

from renderers.art import ActiveRayTracer, Quality
from renderers.art.quality import ClassificationName
from renderers.art.ray_kernel_set import KernelSet, packet_kernels, scalar_kernels
from renderers.scene import Camera, PhongMaterial, Scene

QUALITIES = (
    Quality(0.5, 1 / 1024),
    Quality(0.7, 0.02, renormalise=True),
    Quality(1.0, 0.0, skip_empty=False),
    Quality(0.5, 1 / 255, compact=True),
)


def picture(
    scene: Scene, camera: Camera, quality: Quality, kernels: KernelSet, cells: int
) -> tuple[bytes, dict[str, int]]:
    tracer = ActiveRayTracer(
        scene, quality, threads=1, cache_cells=cells, validate=True, kernels=kernels
    )
    image = tracer.render(camera)
    assert image.depth_mm is not None
    assert tracer.report is not None
    return image.rgba.tobytes() + image.depth_mm.tobytes(), tracer.report.counters


@pytest.mark.parametrize(
    "width", [32, *(pytest.param(w, marks=pytest.mark.slow) for w in (4, 8, 16, 64))]
)
@pytest.mark.parametrize("quality", QUALITIES)
def test_any_width_gives_the_bits_of_the_scalar_march(
    scene: Scene, outside: Camera, quality: Quality, width: int
) -> None:
    """Local and distant lights, highlights, jumps in extinction, odd sizes."""
    for camera in (outside, outside.with_size(7, 50)):
        expected, before = picture(scene, camera, quality, scalar_kernels(), 999)
        found, after = picture(scene, camera, quality, packet_kernels(width), 999)
        assert found == expected
        for counter in ("samples", "contributing", "skipped"):
            assert after[counter] == before[counter]


@pytest.mark.parametrize("cells", [1, 5])
def test_rays_that_miss_cells_go_on_later(
    scene: Scene, outside: Camera, cells: int
) -> None:
    expected, _ = picture(scene, outside, QUALITIES[0], scalar_kernels(), 999)
    found, counters = picture(scene, outside, QUALITIES[0], packet_kernels(32), cells)
    assert found == expected
    assert counters["cells_evicted"] > 0


@pytest.mark.parametrize("quality", [QUALITIES[0], QUALITIES[3]])
def test_a_scene_without_lights_keeps_its_colours(
    scene: Scene, outside: Camera, quality: Quality
) -> None:
    """From the whole volume and from cells that come and go; with gradients, too."""
    bare = Scene(scene.volume, scene.transfer_function, (), PhongMaterial(1, 0, 0))
    expected, _ = picture(bare, outside, quality, scalar_kernels(), 999)
    assert np.frombuffer(expected, np.float32).max() > 0
    for kernels in (scalar_kernels(), packet_kernels(32)):
        whole, counters = picture(bare, outside, quality, kernels, 999)
        assert counters["cells_fetched"] == 0
        bricks, counters = picture(bare, outside, quality, kernels, 5)
        assert counters["cells_evicted"] > 0
        assert whole == bricks == expected
    # Light that gives nothing back is left out, and so little of it does not show
    # although it asks how each wall is turned.
    for diffuse, is_left_out in ((0.0, True), (1e-30, False)):
        material = PhongMaterial(1, diffuse, 0)
        lit = Scene(bare.volume, bare.transfer_function, scene.lights[:1], material)
        found, counters = picture(lit, outside, quality, packet_kernels(32), 999)
        assert (counters["cells_fetched"] == 0) == is_left_out
        assert found == expected


@pytest.mark.parametrize("classification", ["post", "integrated"])
def test_rays_that_outlive_their_packet_go_on_together(
    scene: Scene, outside: Camera, classification: ClassificationName
) -> None:
    """Ends at random, and few of them far away, so that packets leave rays again."""
    camera = outside.with_size(96, 40)
    random = np.random.default_rng(11)
    limit = random.choice([30.0, 34.0, 38.0, 60.0], (40, 96)).astype(np.float32)
    quality = Quality(0.25, 0.0, classification=classification)
    found = []
    for kernels in (scalar_kernels(), packet_kernels(32)):
        for cells in (999, 40):
            tracer = ActiveRayTracer(
                scene, quality, threads=1, cache_cells=cells, kernels=kernels
            )
            image = tracer.render(camera, limit_mm=limit)
            assert image.depth_mm is not None
            assert np.isfinite(image.depth_mm).any()
            found.append(image.rgba.tobytes() + image.depth_mm.tobytes())
    assert len(set(found)) == 1
