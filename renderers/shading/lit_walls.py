"""The walls of a nose and the light on them, as compiled kernels take them."""

import math

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, Volume
from renderers.shading.illumination import ScopeLight
from renderers.shading.kernels.field_reads import DistanceField
from renderers.shading.kernels.path_tracing import FibreLight, WallColour
from renderers.shading.tissue_colour import BONE, SKIN_COLOR, colour_row, colour_table


def seen_field(distance: Volume, camera: Camera) -> DistanceField:
    """Return a distance volume as a camera's eye sees it."""
    matrix = distance.voxel_from_world
    eye = matrix[:3, :3] @ camera.eye_mm + matrix[:3, 3]
    to_voxel = matrix[:3, :3].astype(np.float32)
    return DistanceField(distance.values, to_voxel, eye.astype(np.float32))


def fibre_light(
    light: ScopeLight, camera: Camera, sources: NDArray[np.float32]
) -> FibreLight:
    """Return a scope's light from ``(n, 3)`` fibre ends, mm from the eye."""
    return FibreLight(
        sources,
        camera.frame[3].astype(np.float32),
        np.float32(light.spread),
        np.float32(light.power / len(sources)),
    )


def wall_colour(
    surface: AirSurface, blood_bias: float, blood: NDArray[np.uint8]
) -> WallColour:
    """Return what gives the walls their albedo.

    blood_bias: factor on all blood. blood: codes, see `WallBlood`.
    """
    return WallColour(
        colour_table(),
        blood,
        surface.skin.values,
        np.array(SKIN_COLOR, np.float32),
        colour_row(BONE),
        np.float32(math.sqrt(blood_bias)),
    )
