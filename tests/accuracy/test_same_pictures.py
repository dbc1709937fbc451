"""The six nasal views, to the bit, as both renderers drew them before the house moved.

A change of layout changes no picture. A deliberate change of a picture renews the file:
``PARAVOL_RENEW=1 python -m pytest tests/accuracy/test_same_pictures.py``. The bits are
those of an x86-64 processor with AVX2.
"""

import hashlib
import json
import os
import platform
from pathlib import Path
from typing import Any

import pytest
from numpy.typing import NDArray

from benchmarks.nasal_views import NasalView, acceptance_views, nasal_scene
from paravol.sessions.session_replay import replay_session
from renderers.art import ActiveRayTracer, Quality
from renderers.fsr import FuzzySetRenderer
from renderers.scene import Camera

STORED = Path(__file__).with_name("same_pictures.json")
SIZE = 128

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        platform.machine() != "x86_64", reason="the stored bits are those of x86-64"
    ),
]


def digest(*arrays: NDArray[Any]) -> str:
    """Hash arrays' bytes."""
    total = hashlib.sha256()
    for array in arrays:
        total.update(array.tobytes())
    return total.hexdigest()[:16]


def drawn(view: NasalView) -> dict[str, str]:
    """Draw one view every way; give the hash of each."""
    scene, camera = nasal_scene(view.head), view.camera
    assert isinstance(camera, Camera)
    found = {}
    tracer = ActiveRayTracer(scene, Quality(0.5, 1e-3), threads=2)
    g = tracer.gbuffer(camera)
    found["art scope"] = digest(g.depth_mm, g.normal, g.coverage, g.material)
    found["art classic"] = digest(tracer.render(camera).rgba)
    splats = FuzzySetRenderer(scene, threads=2)
    g = splats.gbuffer(camera)
    found["fsr scope"] = digest(g.depth_mm, g.normal, g.coverage, g.material)
    found["fsr classic"] = digest(splats.render(camera).rgba)
    splats.close()
    return found


def test_every_view_has_the_bits_it_had() -> None:
    now = {view.name: drawn(view) for view in acceptance_views(SIZE)}
    if os.environ.get("PARAVOL_RENEW"):
        STORED.write_text(json.dumps(now, indent=1) + "\n", encoding="utf-8")
    assert now == json.loads(STORED.read_text(encoding="utf-8"))


def test_a_session_recorded_before_is_replayed_the_same() -> None:
    """Frames, clearances and score of the demonstration, flown before the move."""
    folder = Path(__file__).with_name("before_the_move.paravol")
    report = replay_session(folder, threads=2, progress=lambda *_: None)
    assert report.complete
    assert report.samples > 2400
    assert report.frames > 500
    assert report.same_look
    assert report.is_exact
