"""Light from wall to wall, where physics knows the answer."""

import math

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray
from scipy.special import j0, k1

from renderers.scene import AirSurface, Camera, GBuffer
from renderers.shading.illumination import ScopeLight
from renderers.shading.path_tracer import PathLight, PathTracer
from renderers.shading.tissue_colour import colour_table
from tests.renderers.shading.lit_ball import (
    BULB,
    CODE,
    RADIUS_MM,
    ball,
    looking,
    seen_inside,
)


@pytest.mark.parametrize("eye", [(0.0, 0.0, 0.0), (1.0, -2.0, 2.5)])
def test_a_ball_is_lit_as_an_integrating_sphere(
    eye: tuple[float, float, float],
) -> None:
    """``rho / (1 - rho) / R**2`` everywhere, wherever in the ball a bulb hangs."""
    camera = looking(eye, 12)
    tracer = PathTracer(ball(), bounces=40)
    found = tracer.light(seen_inside(camera), camera, BULB, batches=24)
    seen = seen_inside(camera).coverage > 0
    rho = colour_table()[CODE, :3].astype(np.float64)
    expected = rho / (1 - rho) / RADIUS_MM**2
    mean = found.irradiance[seen].mean(axis=0)
    # interpolated in voxels of .45 mm, the ball is 0.1 % smaller than it says
    np.testing.assert_allclose(mean, expected, rtol=0.006)
    if eye == (0.0, 0.0, 0.0):
        return  # every wall sends the same: there is no noise but that of the grid
    apart = (found.irradiance[seen] - mean) / found.standard_error[seen]
    assert np.abs(apart).max() < 6
    # batch means are spread as the error told says
    assert math.sqrt((apart**2).mean()) == pytest.approx(1, abs=0.2)


@pytest.mark.parametrize("bounces", [1, 2, 3])
def test_bounces_are_the_terms_of_a_geometric_series(bounces: int) -> None:
    camera = looking((0.0, 0.0, 0.0), 12)
    tracer = PathTracer(ball(), bounces=bounces)
    found = tracer.light(seen_inside(camera), camera, BULB, batches=8)
    rho = colour_table()[CODE, :3].astype(np.float64)
    series = sum(rho**k for k in range(1, bounces + 1))
    mean = found.irradiance[seen_inside(camera).coverage > 0].mean(axis=0)
    np.testing.assert_allclose(mean, series / RADIUS_MM**2, rtol=0.006)


GAP_MM = 0.3


def between_plates(
    at: NDArray[np.float64], rho: float, bounces: int
) -> NDArray[np.float64]:
    """Give the irradiance, so far along two plates, by a bulb midway between them.

    A plate sends ``gap^2 / (pi (r^2 + gap^2)^2)`` of its light to a place r further
    along the other: in Hankel's transform ``k gap K1(k gap)``, once for each bounce.
    The bulb's light is bounded near it as the path tracer bounds it.
    """
    half = GAP_MM / 2
    far = np.concatenate([np.linspace(0, 3, 3001), np.linspace(3, 60, 6000)[1:]])
    squared = far * far + half * half
    straight = half / np.sqrt(squared) * np.minimum(1 / squared, 1 / 0.6)
    k = np.linspace(1e-4, 16 / GAP_MM, 1200)
    light = np.trapezoid(straight * j0(np.outer(k, far)) * far, far, axis=1)
    bounce = rho * k * GAP_MM * k1(k * GAP_MM)
    light *= sum(bounce**n for n in range(1, bounces + 1))
    found: NDArray[np.float64] = np.trapezoid(
        k * light * j0(np.outer(at, k)), k, axis=1
    )
    return found


def test_a_narrow_gap_passes_light_on_as_two_plates() -> None:
    """Where rays begin or end off the walls the gap is narrower than it is."""
    room = ball()
    z = np.abs(np.arange(45) - 22.0) * 0.45 - GAP_MM / 2
    plates = np.broadcast_to(z[:, None, None], (45, 45, 45)).astype(np.float32)
    surface = AirSurface(
        room.distance.with_values(plates.copy(), 1.0), room.blood, room.skin
    )
    camera = Camera.looking_at(
        np.zeros(3), np.array([2.0, 0, 0.15]), extent=math.radians(1.2), size=(24, 24)
    )
    rays = camera.rays()[1]
    depth = GAP_MM / 2 / np.maximum(rays[..., 2], 1e-6)
    along = np.hypot(depth * rays[..., 0], depth * rays[..., 1])
    seen = (np.linalg.norm(rays, axis=-1) > 0.5) & (along > 1.5) & (along < 2.5)
    buffer = GBuffer.empty(24, 24)
    buffer.depth_mm[seen] = depth[seen]
    buffer.normal[seen] = (0, 0, -1)
    buffer.coverage[seen] = 1
    tracer = PathTracer(surface, bounces=12)
    light = tracer.light(buffer, camera, BULB, batches=32)
    tracer.close()
    rho = float(colour_table()[CODE, 0])
    expected = between_plates(along[seen], rho, 12).mean()
    found, error = light.irradiance[seen, 0], light.standard_error[seen, 0]
    noise = math.sqrt(float((error.astype(float) ** 2).sum())) / len(error) / expected
    assert noise < 0.005
    # .02 mm above a wall is a fifteenth of the gap; .08 mm took 13 % of the light
    assert found.mean() == pytest.approx(expected, rel=0.05)


def tube_light(
    surface: AirSurface,
    camera: Camera,
    gbuffer: GBuffer,
    *,
    threads: int = 2,
    batches: int = 4,
    seed: int = 0,
    light: ScopeLight | None = None,
) -> PathLight:
    tracer = PathTracer(surface, threads=threads, seed=seed)
    try:
        return tracer.light(gbuffer, camera, light or ScopeLight(), batches=batches)
    finally:
        tracer.close()


def test_threads_do_not_change_a_bit(
    surface: AirSurface, camera: Camera, sparse: GBuffer
) -> None:
    found = [
        tube_light(surface, camera, sparse, threads=n, batches=2) for n in (1, 2, 3)
    ]
    for other in found[1:]:
        assert_array_equal(other.irradiance, found[0].irradiance)
        assert_array_equal(other.standard_error, found[0].standard_error)
    unlike = tube_light(surface, camera, sparse, batches=2, seed=1)
    assert (unlike.irradiance != found[0].irradiance).any()


def test_four_times_the_paths_halve_the_noise(
    surface: AirSurface, camera: Camera, sparse: GBuffer
) -> None:
    few = tube_light(surface, camera, sparse, batches=4)
    many = tube_light(surface, camera, sparse, batches=16, seed=5)
    assert many.noise() == pytest.approx(few.noise() / 2, rel=0.1)
    assert (few.paths, many.paths) == (64, 256)
    # and what the errors say of two estimates is true of their difference
    seen = sparse.coverage > 0
    error = np.hypot(few.standard_error, many.standard_error)[seen]
    apart = (few.irradiance - many.irradiance)[seen]
    assert math.sqrt((apart**2).mean() / (error**2).mean()) == pytest.approx(1, abs=0.1)


def test_light_is_linear_in_power_and_red_wins(
    surface: AirSurface, camera: Camera, sparse: GBuffer
) -> None:
    one = tube_light(surface, camera, sparse, batches=2)
    two = tube_light(surface, camera, sparse, batches=2, light=ScopeLight(power=2))
    np.testing.assert_allclose(two.irradiance, 2 * one.irradiance, rtol=1e-5)
    red, green, _ = one.irradiance.reshape(-1, 3).mean(axis=0)
    assert red > 2 * green
    assert not one.irradiance[sparse.coverage == 0].any()


def test_what_cannot_be_is_refused(
    surface: AirSurface, camera: Camera, sparse: GBuffer
) -> None:
    with pytest.raises(ValueError, match="at least one bounce, got 0"):
        PathTracer(surface, bounces=0)
    with pytest.raises(ValueError, match=r"within 0\.\.10, got nan"):
        PathTracer(surface, blood_bias=math.nan)
    tracer = PathTracer(surface)
    with pytest.raises(ValueError, match="two batches on, got 1"):
        tracer.light(sparse, camera, ScopeLight(), batches=1)
    with pytest.raises(ValueError, match="does not fit"):
        tracer.light(sparse, looking((0, 0, 0), 12), ScopeLight())
