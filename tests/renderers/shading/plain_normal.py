"""The normal that bounce light has of a wall, without vectors."""

import numpy as np
from numpy.typing import NDArray

from renderers.shading.kernels.field_reads import tap

f32 = np.float32
Floats = NDArray[np.float32]


def plain_normal(
    values: Floats, m: Floats, x: np.float32, y: np.float32, z: np.float32
) -> Floats:
    """Give the normal towards air by six reads, operation by operation."""
    h = f32(0.6)
    gx = f32(tap(values, x + h, y, z)) - f32(tap(values, x - h, y, z))
    gy = f32(tap(values, x, y + h, z)) - f32(tap(values, x, y - h, z))
    gz = f32(tap(values, x, y, z + h)) - f32(tap(values, x, y, z - h))
    slope = m[0] * gx + m[1] * gy + m[2] * gz
    square = slope[0] * slope[0] + slope[1] * slope[1] + slope[2] * slope[2]
    scale: Floats = slope * (f32(-1) / np.sqrt(square + f32(1e-12)))
    return scale
