"""The same bits whichever processor the kernels are compiled for."""

import hashlib
import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

DRAW = """
import hashlib
from renderers.art import ActiveRayTracer, Quality
from renderers.scene import Camera, Projection
from tests.scenes import make_scene

scene = make_scene()
centre = scene.volume.center_mm
camera = Camera.looking_at(
    centre + [26.0, -18, 10], centre, extent=0.5, size=(50, 43),
    projection=Projection.PERSPECTIVE,
)
digest = hashlib.sha256()
for compact in (False, True):
    quality = Quality(0.5, 1 / 1024, compact=compact)
    tracer = ActiveRayTracer(scene, quality, packet=32)
    image, found = tracer.render(camera), tracer.gbuffer(camera)
    for part in (image.rgba, image.depth_mm, found.depth_mm, found.normal):
        digest.update(part.tobytes())
print(digest.hexdigest())
"""


@pytest.mark.slow
@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="names x86 processors"
)
def test_code_for_any_processor_draws_the_same_bits(tmp_path: Path) -> None:
    """Without AVX, with AVX2, and for the one at hand."""
    found = set()
    for name, features in (("nehalem", ""), ("haswell", "+avx2"), ("", "")):
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / f"for{name}")}
        if name:
            # Without the second line numba keeps the instructions of the host.
            environment |= {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": features}
        child = subprocess.run(
            [sys.executable, "-c", DRAW],
            cwd=ROOT,
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        )
        digest = child.stdout.strip()
        assert len(digest) == 2 * hashlib.sha256().digest_size
        found.add(digest)
    assert len(found) == 1
