import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderers.scene import Camera, GBuffer
from renderers.shading import CameraPass
from renderers.shading.bands import RowBands
from renderers.shading.camera import camera_pass
from renderers.shading.camera.camera_settings import CameraSettings
from renderers.shading.camera.optics import make_optics
from renderers.shading.camera.scalar_pass import StagedCamera

ALONE = RowBands(1)


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_do_not_change_a_bit(threads: int) -> None:
    optics = make_optics(CameraSettings(), 0.77, 48, 40)
    rng = np.random.default_rng(0)
    radiance = rng.gamma(0.5, 0.5, (40, 48, 3)).astype(np.float32)
    depth = np.full((40, 48), 3.0, np.float32)
    alone = (
        StagedCamera(optics, RowBands(1), 1)
        .expose(radiance, depth, 1.0, 2)
        .finish(ALONE)
    )
    bands = RowBands(threads)
    shared = (
        StagedCamera(optics, bands, 1).expose(radiance, depth, 1.0, 2).finish(bands)
    )
    bands.close()
    assert_array_equal(shared, alone)


def test_it_serves_where_vectors_do_not_compile(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    camera = Camera.looking_at((0, 0, 0), (0, 9, 0), size=(48, 40))
    radiance = np.full((40, 48, 3), 0.2, np.float32)
    buffer = GBuffer.empty(40, 48)
    by_vectors, _ = CameraPass(threads=1).finish(radiance, buffer, camera, gain=1.0)
    monkeypatch.setattr(camera_pass, "vector_problem", lambda: "no such builder")
    by_scalars, _ = CameraPass(threads=1).finish(radiance, buffer, camera, gain=1.0)
    assert np.abs(by_vectors.astype(int) - by_scalars).max() <= 1
    bands = RowBands(1)
    optics = make_optics(CameraSettings(), camera.extent, 48, 40)
    expected = (
        StagedCamera(optics, bands, 1)
        .expose(radiance, buffer.depth_mm, 1.0, 0)
        .finish(bands)
    )
    assert_array_equal(by_scalars, expected)
