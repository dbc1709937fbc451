"""Splats lit once for all views.

Diffuse light and the classified colour do not depend on where the eye is.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.extract import UNDEFINED

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
I16 = NDArray[np.int16]
U16 = NDArray[np.uint16]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _decode(octahedral: I16, s: int) -> tuple[float, float, float]:
    """Unpack a normal; zeros where the gradient vanished."""
    if octahedral[s, 0] == UNDEFINED:
        return 0.0, 0.0, 0.0
    x = octahedral[s, 0] / 32767.0
    y = octahedral[s, 1] / 32767.0
    z = 1.0 - abs(x) - abs(y)
    if z < 0:
        a = (1.0 - abs(y)) * (1.0 if x >= 0 else -1.0)
        y = (1.0 - abs(x)) * (1.0 if y >= 0 else -1.0)
        x = a
    r = 1.0 / math.sqrt(x * x + y * y + z * z)
    return x * r, y * r, z * r


@njit(cache=True, nogil=True, error_model="numpy")
def paint_splats(
    offsets: I64, x: U16, ny: int, octahedral: I16, value: F32,
    world_from_voxel: F64, volume_mm3: float, table: F32, table_low: float,
    table_scale: float, lights: F64, ambient: float, diffuse: float, places: F32,
    paints: F32,
) -> None:  # fmt: skip
    """Write what all views share: grid places with optical mass, lit colours.

    table: ``(m, 4)`` colour and extinction over densities. lights: ``(l, 7)`` vector,
    colour, 1 if local. places: ``(n, 4)`` i, j, k and extinction times volume (mm^2).
    paints: ``(n, 4)`` linear RGB, and the size in grid steps: one.
    """
    m = world_from_voxel
    for row in range(offsets.shape[0] - 1):
        j = float(row % ny)
        k = float(row // ny)
        for s in range(offsets[row], offsets[row + 1]):
            i = float(x[s])
            t = (value[s] - table_low) * table_scale + 0.5
            c = min(max(int(t), 0), table.shape[0] - 1)
            nx, ny_, nz = _decode(octahedral, s)
            red = ambient
            green = ambient
            blue = ambient
            if nx == 0 and ny_ == 0 and nz == 0:
                # no normal, no shading: the plain colour
                red = green = blue = 1.0
            else:
                for light in range(lights.shape[0]):
                    lx, ly, lz = lights[light, 0], lights[light, 1], lights[light, 2]
                    if lights[light, 6] > 0:
                        lx -= m[0, 0] * i + m[0, 1] * j + m[0, 2] * k + m[0, 3]
                        ly -= m[1, 0] * i + m[1, 1] * j + m[1, 2] * k + m[1, 3]
                        lz -= m[2, 0] * i + m[2, 1] * j + m[2, 2] * k + m[2, 3]
                        r = 1.0 / max(math.sqrt(lx * lx + ly * ly + lz * lz), 1e-9)
                        lx *= r
                        ly *= r
                        lz *= r
                    f = diffuse * max(nx * lx + ny_ * ly + nz * lz, 0.0)
                    red += f * lights[light, 3]
                    green += f * lights[light, 4]
                    blue += f * lights[light, 5]
            places[s, 0] = i
            places[s, 1] = j
            places[s, 2] = k
            places[s, 3] = table[c, 3] * volume_mm3
            paints[s, 0] = table[c, 0] * red
            paints[s, 1] = table[c, 1] * green
            paints[s, 2] = table[c, 2] * blue
            paints[s, 3] = 1.0
