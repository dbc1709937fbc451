"""A small bumpy tube of tissue, and a plain sphere tracer to look into it with."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer, Volume

SPACING_MM = 0.5
CENTRE_MM = np.array([12.0, -30.0, 41.0])


def make_surface(direction: NDArray[np.float64] | None = None) -> AirSurface:
    """Give a tube of 5 mm along world y, curved and bumpy, skin at one end."""
    axes = np.eye(3) if direction is None else direction
    shape = (40, 72, 40)
    size = np.array(shape[::-1])
    origin = CENTRE_MM - axes @ ((size - 1) / 2 * SPACING_MM)
    k, j, i = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")
    local = np.stack([i, j, k], axis=-1) * SPACING_MM
    x, y, z = np.moveaxis(local @ axes.T + origin - CENTRE_MM, -1, 0)
    distance = np.hypot(x - 1.5 * np.sin(y / 9), z) - 5
    distance += 0.3 * np.sin(1.7 * x) * np.sin(1.3 * y) * np.cos(1.5 * z)
    distance = np.maximum(distance, y - 16).astype(np.float32)
    blood = np.clip(np.round(255 * np.sqrt(0.1 + 0.004 * y)), 0, 255).astype(np.uint8)
    skin = np.clip(255 * (-y - 12) / 3, 0, 255).astype(np.uint8)

    def volume(values: NDArray[np.generic], background: float) -> Volume:
        return Volume(values, np.full(3, SPACING_MM), origin, axes, background)

    return AirSurface(volume(distance, 1.0), volume(blood, 0), volume(skin, 0))


def trace(surface: AirSurface, camera: Camera) -> GBuffer:
    """Find the zero set of the distance by sphere tracing; plain numpy."""
    distance = surface.distance
    origins, rays = camera.rays()
    seen = np.linalg.norm(rays, axis=-1) > 0.5
    origins, rays = origins[seen], rays[seen]
    t = np.zeros(len(rays))
    for _ in range(80):
        value = distance.sample(origins + t[:, None] * rays)
        t += np.where(value < -1e-4, np.maximum(-0.7 * value, 1e-3), 0)
    points = origins + t[:, None] * rays
    h = 0.4
    gradient = np.stack(
        [
            distance.sample(points + h * axis) - distance.sample(points - h * axis)
            for axis in np.eye(3)
        ],
        axis=-1,
    )
    length = np.linalg.norm(gradient, axis=-1)
    hit = (np.abs(distance.sample(points)) < 1e-2) & (length > 1e-3) & (t < 60)
    normal = -gradient / np.maximum(length, 1e-9)[:, None]
    buffer = GBuffer.empty(camera.height, camera.width)
    rows, columns = np.nonzero(seen)
    rows, columns = rows[hit], columns[hit]
    buffer.depth_mm[rows, columns] = t[hit]
    buffer.normal[rows, columns] = normal[hit]
    buffer.coverage[rows, columns] = 1
    return buffer


def make_camera(width: int = 72, height: int = 64) -> Camera:
    """Look down the tube from near its skin end."""
    eye = CENTRE_MM + np.array([0.4, -13.5, 0.3])
    return Camera.looking_at(
        eye,
        CENTRE_MM + np.array([1.0, 5.0, -0.5]),
        extent=math.radians(44),
        size=(width, height),
    )


@pytest.fixture(scope="session")
def surface() -> AirSurface:
    return make_surface()


@pytest.fixture(scope="session")
def turned_surface() -> AirSurface:
    """The same tissue on a grid whose axes are not the patient's."""
    a = math.radians(25)
    turn = np.array(
        [[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]]
    )
    return make_surface(turn)


@pytest.fixture(scope="session")
def camera() -> Camera:
    return make_camera()


@pytest.fixture(scope="session")
def gbuffer(surface: AirSurface, camera: Camera) -> GBuffer:
    """The tube seen by the camera, with one patch of every material."""
    buffer = trace(surface, camera)
    for m in range(7):
        buffer.material[20 + 4 * m : 23 + 4 * m, 25:40] = m
    buffer.coverage[50:54, 40:50] *= 0.5
    return buffer


@pytest.fixture(scope="session")
def tissue_gbuffer(surface: AirSurface, camera: Camera) -> GBuffer:
    return trace(surface, camera)


@pytest.fixture(scope="session")
def sparse(tissue_gbuffer: GBuffer) -> GBuffer:
    """Every fourth pixel of every fourth row; the others show nothing."""
    buffer = GBuffer.empty(*tissue_gbuffer.size)
    for name in ("depth_mm", "normal", "coverage"):
        getattr(buffer, name)[::4, ::4] = getattr(tissue_gbuffer, name)[::4, ::4]
    return buffer


@pytest.fixture(scope="session")
def fine_gbuffer(surface: AirSurface, camera: Camera) -> GBuffer:
    """The same view at twice the size."""
    return trace(surface, camera.with_size(2 * camera.width, 2 * camera.height))
