"""A ball of air in tissue of one colour, whose light physics knows."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer, Volume
from renderers.shading.illumination import ScopeLight

RADIUS_MM = 8.0
CODE = 160
BULB = ScopeLight(ring_radius_mm=0.0, spread=0.0)
"""Shines alike in all directions, from the eye."""


def ball() -> AirSurface:
    """Give the ball on a grid of 0.45 mm."""
    n, spacing = 45, 0.45
    at = (np.arange(n) - (n - 1) / 2) * spacing
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    distance = (np.sqrt(x * x + y * y + z * z) - RADIUS_MM).astype(np.float32)

    def volume(values: NDArray[np.generic], background: float) -> Volume:
        origin = np.full(3, at[0])
        return Volume(values, np.full(3, spacing), origin, np.eye(3), background)

    code = np.full(distance.shape, CODE, np.uint8)
    return AirSurface(
        volume(distance, 1.0), volume(code, 0), volume(np.zeros_like(code), 0)
    )


def looking(eye: tuple[float, float, float], size: int) -> Camera:
    """Look across the ball."""
    return Camera.looking_at(eye, (0.3, 5.0, 0.2), size=(size, size))


def seen_inside(camera: Camera) -> GBuffer:
    """Meet the ball's wall exactly."""
    origins, rays = camera.rays()
    seen = np.linalg.norm(rays, axis=-1) > 0.5
    along = (origins * rays).sum(-1)
    depth = -along + np.sqrt(along**2 - (origins**2).sum(-1) + RADIUS_MM**2)
    buffer = GBuffer.empty(camera.height, camera.width)
    buffer.depth_mm[seen] = depth[seen]
    buffer.normal[seen] = -(origins + depth[..., None] * rays)[seen] / RADIUS_MM
    buffer.coverage[seen] = 1
    return buffer
