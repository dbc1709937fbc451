"""Strips drawn at once show what packets of rays draw, bit by bit."""

from dataclasses import replace

import numpy as np
import pytest

from renderers.art import ActiveRayTracer, Quality
from renderers.art.kernels.march_types import BLOCK_COLUMNS
from renderers.art.quality import ClassificationName
from renderers.art.regions import Gather
from renderers.scene import Camera, PhongMaterial, Scene
from tests.slow_cases import slow


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
