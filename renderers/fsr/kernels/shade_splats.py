"""Splats lit once for all views.

Diffuse light and the classified colour do not depend on where the eye is.
"""

import math
from typing import NamedTuple

from numba import njit

from renderers.fsr.kernels.array_types import F32, F64, I16, I64, U16
from renderers.fsr.kernels.extract_splats import UNDEFINED
from renderers.fsr.kernels.project_splats import Splats


class ColorTable(NamedTuple):
    """Colour and extinction ``(m, 4)`` over densities from `low` on."""

    entries: F32
    low: float
    per_density: float


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
def shade_splats(
    offsets: I64, x: U16, ny: int, octahedral: I16, value: F32,
    world_from_voxel: F64, volume_mm3: float, table: ColorTable, lights: F64,
    ambient: float, diffuse: float, splats: Splats,
) -> None:  # fmt: skip
    """Write what all views share: grid places with optical mass, lit colours.

    lights: ``(l, 7)`` vector, colour, 1 if local. splats: written to, of size one.
    """
    places, colors = splats
    entries, low, per_density = table
    m = world_from_voxel
    for row in range(offsets.shape[0] - 1):
        j = float(row % ny)
        k = float(row // ny)
        for s in range(offsets[row], offsets[row + 1]):
            i = float(x[s])
            t = (value[s] - low) * per_density + 0.5
            c = min(max(int(t), 0), entries.shape[0] - 1)
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
            places[s, 3] = entries[c, 3] * volume_mm3
            colors[s, 0] = entries[c, 0] * red
            colors[s, 1] = entries[c, 1] * green
            colors[s, 2] = entries[c, 2] * blue
            colors[s, 3] = 1.0
