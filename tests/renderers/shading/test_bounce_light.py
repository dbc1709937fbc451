import math

import numpy as np
import pytest

from renderers.scene import AirSurface, Camera, GBuffer, Volume
from renderers.shading import ScopeLight
from renderers.shading.bounce_light import CONE_HALF_ANGLE, VirtualLights

RADIUS_MM = 9.0


@pytest.fixture(scope="module")
def hollow() -> Volume:
    """A spherical hole of 9 mm about (1, 2, 3)."""
    axis = np.arange(53) * 0.4
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    r = np.sqrt((x - 10.4) ** 2 + (y - 10.4) ** 2 + (z - 10.4) ** 2)
    origin = np.array([1.0, 2.0, 3.0]) - 10.4
    return Volume((r - RADIUS_MM).astype(np.float32), np.full(3, 0.4), origin)


@pytest.fixture(scope="module")
def inside() -> Camera:
    return Camera.looking_at((1, 2, 3), (1, 12, 3), size=(32, 32))


def test_lights_sit_on_the_wall_facing_the_eye(hollow: Volume, inside: Camera) -> None:
    table = VirtualLights.trace(hollow, inside, ScopeLight(), 128).table
    assert table.shape == (8, 128)
    np.testing.assert_allclose(np.linalg.norm(table[:3], axis=0), RADIUS_MM, atol=0.1)
    np.testing.assert_allclose(table[3:6], -table[:3] / RADIUS_MM, atol=0.03)


@pytest.mark.parametrize("spread", [0.0, 2.8])
def test_their_flux_is_the_integral_of_the_spot(
    hollow: Volume, inside: Camera, spread: float
) -> None:
    light = ScopeLight(spread=spread, power=3.0)
    table = VirtualLights.trace(hollow, inside, light, 256).table
    span = 1 - math.cos(CONE_HALF_ANGLE)
    share = span if spread == 0 else (1 - math.exp(-spread * span)) / spread
    assert float(table[6].sum()) == pytest.approx(6 * math.pi * share, rel=1e-3)


def test_the_spiral_is_even(hollow: Volume, inside: Camera) -> None:
    # equal fluxes, and an even spread: the mean direction lies on the view axis
    table = VirtualLights.trace(hollow, inside, ScopeLight(spread=0), 256).table
    mean = table[:3].mean(axis=1) / RADIUS_MM
    across = inside.frame[1:3] @ mean
    assert np.abs(across).max() < 0.01


def test_open_directions_have_no_light(surface: AirSurface, inside: Camera) -> None:
    # an eye far outside the volume sees nothing to light
    lights = VirtualLights.trace(surface.distance, inside, ScopeLight(), 64)
    assert lights.table.shape == (8, 0)
    grid = lights.gather(GBuffer.empty(32, 32), inside)
    assert not grid.any()


def test_a_grid_turned_against_the_world_changes_little(
    surface: AirSurface, turned_surface: AirSurface, camera: Camera
) -> None:
    frame = camera.frame.copy()
    frame[0] += (0, 9, 0)  # from the end to the middle, where both grids reach
    middle = Camera(frame, camera.extent, camera.width, camera.height)
    a = VirtualLights.trace(surface.distance, middle, ScopeLight(), 64).table
    b = VirtualLights.trace(turned_surface.distance, middle, ScopeLight(), 64).table
    # at the far end a ray or two may miss one of the grids
    assert min(a.shape[1], b.shape[1]) >= 62
    for light in b.T:
        if np.linalg.norm(light[:3]) < 12:
            apart = np.linalg.norm(a[:3] - light[:3, None], axis=0)
            assert float(apart.min()) < 0.35
            assert light[6] == a[6, apart.argmin()]


def test_a_count_is_needed(hollow: Volume, inside: Camera) -> None:
    with pytest.raises(ValueError, match="at least one"):
        VirtualLights.trace(hollow, inside, ScopeLight(), 0)
