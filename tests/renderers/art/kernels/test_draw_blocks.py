"""Strips drawn at once show what packets of rays draw, bit by bit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderers.art import ActiveRayTracer, Quality
from renderers.art.kernels.draw_blocks import BLOCK, any_waits, deliver, list_tiles
from renderers.art.kernels.march_types import BLOCK_COLUMNS, TILE_PX
from renderers.art.quality import ClassificationName
from renderers.art.ranks.rays import tile_order
from renderers.art.regions import Gather
from renderers.scene import Camera, PhongMaterial, Scene
from tests.slow_cases import slow


def test_a_block_has_no_more_rays_than_its_memory() -> None:
    assert BLOCK == BLOCK_COLUMNS * TILE_PX


@given(columns=st.integers(1, BLOCK_COLUMNS), rows=st.integers(1, TILE_PX))
@settings(max_examples=30)
def test_tiles_are_those_of_packets(columns: int, rows: int) -> None:
    order = np.full(BLOCK, -1, np.int32)
    list_tiles(columns, rows, order)
    assert order[: columns * rows].tolist() == tile_order(columns, rows).tolist()
    assert (order[columns * rows :] == -1).all()


def test_a_ray_that_waits_is_seen() -> None:
    cursor = np.ones((9, 4), np.int32)
    cursor[:, 3] = 0
    assert not any_waits(cursor.ravel())
    cursor[7, 3] = 5
    assert any_waits(cursor.ravel())


@given(pixels=st.integers(1, 21), seed=st.integers(0, 10**6))
@settings(max_examples=50)
def test_a_row_is_delivered_and_counted(pixels: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    value = random.random((pixels, 4), np.float32)
    depth = random.random(pixels, np.float32)
    seen, far = np.zeros((pixels, 4), np.float32), np.zeros(pixels, np.float32)
    done = random.random(pixels) < 0.5
    fresh = int(np.count_nonzero(~done))
    early = int(np.count_nonzero(1 - value[:, 3] < np.float32(0.3)))
    for wanted in ((fresh, early), (0, early)):
        found = deliver(value.ravel(), depth, np.float32(0.3), seen.ravel(), far, done)
        assert found == wanted
    np.testing.assert_array_equal(seen, value)
    np.testing.assert_array_equal(far, depth)
    assert done.all()


@pytest.mark.parametrize(
    ("mode", "classification"),
    [
        ("scope", "post"),
        ("lit", "post"),
        ("lit", "integrated"),
        *slow(("unlit", "post"), ("unlit", "integrated")),
    ],
)
def test_strips_show_what_packets_show(
    scene: Scene, outside: Camera, mode: str, classification: ClassificationName
) -> None:
    """First with cells to be fetched, then with all; some rays end early or at once.

    Wider than a block and no multiple of a tile; some pixels, no whole block, are there
    already.
    """
    if mode == "unlit":
        scene = replace(scene, lights=(), material=PhongMaterial(1, 0, 0))
    camera = outside.with_size(BLOCK_COLUMNS + 13, 43)
    random = np.random.default_rng(5)
    limit = random.choice([0.0, 30.0, np.inf], (43, camera.width)).astype(np.float32)
    quality = Quality(1.0, 1 / 255, compact=True, classification=classification)
    found = []
    for packet in (None, 32):
        for threads in (1, 2):
            tracer = ActiveRayTracer(scene, quality, threads=threads, packet=packet)
            for _ in range(2):
                gather = Gather(camera.width, camera.height)
                gather.done[9:17] = True
                gather.missing -= 8 * camera.width
                trace = tracer.gbuffer if mode == "scope" else tracer.render
                trace(camera, None, gather, limit_mm=limit)
                assert tracer.report is not None
                counters = tracer.report.counters
                assert gather.missing == 0
                assert gather.done.all()
                assert np.isfinite(gather.depth).any()
                found.append(
                    (
                        gather.value.tobytes() + gather.depth.tobytes(),
                        counters["samples"],
                        counters["contributing"],
                        counters["skipped"],
                        counters["ended_early"],
                    )
                )
    assert len(set(found)) == 1


def test_where_cells_come_and_go_rays_go_by_packets(
    scene: Scene, outside: Camera
) -> None:
    """Which cells are used has to be known there, and strips do not note it."""
    found = []
    for cells in (999, 5):
        tracer = ActiveRayTracer(
            scene, Quality(1.0, 0.0, compact=True), cache_cells=cells, validate=True
        )
        found.append(tracer.render(outside).rgba.tobytes())
        assert tracer.report is not None
        assert (tracer.report.counters["cells_evicted"] > 0) == (cells == 5)
    assert found[0] == found[1]
