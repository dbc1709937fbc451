"""Packets of any width find the same surface, bit by bit."""

import pytest

from renderers.art import ActiveRayTracer, Quality
from renderers.scene import Camera, Scene
from tests.slow_cases import slow


def surface(
    scene: Scene, camera: Camera, quality: Quality, packet: int, cells: int
) -> tuple[bytes, dict[str, int]]:
    tracer = ActiveRayTracer(
        scene, quality, threads=1, cache_cells=cells, validate=True, packet=packet
    )
    found = tracer.gbuffer(camera)
    assert tracer.report is not None
    parts = (found.depth_mm, found.normal, found.coverage)
    return b"".join(part.tobytes() for part in parts), tracer.report.counters


@pytest.mark.parametrize("width", [4, *slow(8, 16, 64)])
@pytest.mark.parametrize("skip_empty", [True, False])
def test_any_width_gives_the_same_bits(
    scene: Scene, inside: Camera, outside: Camera, skip_empty: bool, width: int
) -> None:
    quality = Quality(0.6, 0.0, skip_empty=skip_empty)
    for camera in (inside, outside.with_size(7, 50)):
        expected, before = surface(scene, camera, quality, 32, 999)
        found, after = surface(scene, camera, quality, width, 999)
        assert found == expected
        for counter in ("samples", "contributing", "skipped"):
            assert after[counter] == before[counter]


@pytest.mark.parametrize("cells", [1, 2])
def test_rays_that_miss_cells_go_on_later(
    scene: Scene, inside: Camera, cells: int
) -> None:
    quality = Quality(0.5, 0.0)
    expected, _ = surface(scene, inside, quality, 32, 999)
    found, counters = surface(scene, inside, quality, 32, cells)
    assert found == expected
    assert counters["cells_evicted"] > 0
