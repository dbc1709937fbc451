import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderers.scene import AirSurface, Camera, GBuffer
from renderers.shading import (
    CameraPass,
    ScopeLight,
    ScopeShader,
    Tier,
    downsample_gbuffer,
    downsample_radiance,
    scope_picture,
)


def test_downsampling_keeps_the_light() -> None:
    radiance = np.random.default_rng(0).random((12, 16, 3)).astype(np.float32)
    small = downsample_radiance(radiance)
    assert small.shape == (6, 8, 3)
    expected = radiance.astype(np.float64).reshape(6, 2, 8, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(small, expected, rtol=1e-6)


def test_the_nearest_surface_decides_where_the_camera_focuses() -> None:
    buffer = GBuffer.empty(4, 4)
    buffer.depth_mm[0, 1] = 7
    buffer.depth_mm[1, 0] = 3
    buffer.material[1, 0] = 2
    buffer.normal[1, 0] = (0, 0, 1)
    buffer.coverage[0, 1] = buffer.coverage[1, 0] = 1
    small = downsample_gbuffer(buffer)
    assert small.size == (2, 2)
    assert small.depth_mm[0, 0] == 3
    assert small.material[0, 0] == 2
    assert_array_equal(small.normal[0, 0], [0, 0, 1])
    assert small.coverage[0, 0] == 0.5
    assert np.isinf(small.depth_mm[1, 1])
    assert small.coverage[1, 1] == 0


def test_one_sample_a_pixel_is_shading_then_camera(
    surface: AirSurface, camera: Camera, gbuffer: GBuffer
) -> None:
    shader = ScopeShader(surface, threads=1)
    camera_pass = CameraPass(threads=1)
    light = ScopeLight()
    picture, gain = scope_picture(gbuffer, camera, shader, camera_pass, light)
    again, _ = camera_pass.finish(
        shader.shade(gbuffer, camera, light), gbuffer, camera, gain=gain
    )
    assert_array_equal(picture, again)


def test_a_snapshot_is_the_full_picture_with_less_noise_of_sampling(
    surface: AirSurface, camera: Camera, tissue_gbuffer: GBuffer, fine_gbuffer: GBuffer
) -> None:
    light, camera_pass = ScopeLight(), CameraPass(threads=1)
    snapshot, gain = scope_picture(
        fine_gbuffer,
        camera,
        ScopeShader(surface, Tier.SNAPSHOT, threads=1),
        camera_pass,
        light,
    )
    full, _ = scope_picture(
        tissue_gbuffer,
        camera,
        ScopeShader(surface, Tier.FULL, threads=1),
        camera_pass,
        light,
        gain=gain,
    )
    assert snapshot.shape == full.shape
    difference = snapshot.astype(float) - full
    assert abs(float(difference.mean())) < 2
    assert float(np.abs(difference).mean()) < 5


def test_a_buffer_of_the_wrong_size_is_refused(
    surface: AirSurface, camera: Camera, gbuffer: GBuffer
) -> None:
    shader = ScopeShader(surface, Tier.SNAPSHOT, threads=1)
    with pytest.raises(ValueError, match="tier SNAPSHOT needs a G-buffer"):
        scope_picture(gbuffer, camera, shader, CameraPass(threads=1), ScopeLight())
    with pytest.raises(ValueError, match="even sizes"):
        downsample_radiance(np.zeros((3, 4, 3), np.float32))
