"""How a camera bounds what is drawn: planes around its view, tiles of its picture."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.view_planes import SOFT_PX, STEEPEST_CONE_RAD, Lens
from renderers.scene import Camera, Projection
from renderers.scene.camera import STOP_MARGIN_PX
from system import UserError

CONE_SIDES = 8
"""Planes around the round field: eight waste 5 % of its area, four 27 %."""

_ANGLES = 2 * math.pi * (np.arange(CONE_SIDES) + 0.5) / CONE_SIDES
_CONE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)
_SIDES = np.array([[-1.0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]])


def lens_of(camera: Camera) -> Lens:
    """Return a camera's lens as kernels take it."""
    return Lens(int(camera.projection), camera.extent, camera.width, camera.height)


@lru_cache(maxsize=64)
def lens_planes(
    projection: Projection, extent: float, width: int, height: int
) -> NDArray[np.float64]:
    """Bound a view, and two pixels around it, by planes ``(p, 4)``.

    By right, up and forward in mm from the eye: unit normal and offset. A point in view
    is on the positive side of all of them. The pixels are for footprints, which are
    softened by half a pixel.
    """
    half = min(width, height) / 2
    wide, high = width / 2 / half, height / 2 / half
    wide += SOFT_PX / half
    high += SOFT_PX / half
    normals: NDArray[np.float64] = np.empty((0, 3))
    if projection is Projection.ORTHOGRAPHIC:
        offsets = extent * np.array([wide, wide, high, high])
        return np.column_stack([_SIDES, offsets])
    if projection is Projection.EQUIDISTANT:
        angle = extent * (1 + (STOP_MARGIN_PX + 1) / half)
        if angle < STEEPEST_CONE_RAD:
            normals = np.full((len(_CONE), 3), math.sin(angle))
            normals[:, :2] = -math.cos(angle) * _CONE
    else:
        slope = math.tan(extent)
        aside, above = slope * wide, slope * high
        normals = np.array(
            [[-1, 0, aside], [1, 0, aside], [0, -1, above], [0, 1, above], [0, 0, 1]]
        )
        normals /= np.sqrt((normals * normals).sum(axis=1, keepdims=True))
    return np.column_stack([normals, np.zeros(len(normals))])


def tile_grid(
    height: int, width: int, tile: tuple[int, int], most: int
) -> tuple[int, int]:
    """Return the tiles down and across a picture of `height` x `width` pixels.

    tile: height and width of one. Raises UserError for a picture of more than `most`
    either way.
    """
    down, across = -(-height // tile[0]), -(-width // tile[1])
    if max(down, across) > most:
        raise UserError(
            f"a picture may have {most * tile[1]} x {most * tile[0]} pixels, got "
            f"{width} x {height}"
        )
    return down, across
