"""Compiled: blur what ground metal mirrors."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.shading.kernels.indirect import METAL, Bytes, Floats, f32


@njit(cache=True, nogil=True, error_model="numpy")
def blur_rows(
    depth: Floats, normal: Floats, material: Bytes, stride: int, reach: int,
    points: NDArray[np.bool_], grid: Floats, blurred: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Blur what metal mirrors at `points`, rows ``first..last``; copy the rest.

    Ground steel is no looking-glass: its lobe is wider than the way from one lattice
    point to the next. reach: pixels over which a weight falls to nothing.
    """
    height, width = depth.shape
    rows, columns = grid.shape[0], grid.shape[1]
    steps = (reach - 1) // stride
    for gy in range(first, last):
        y = min(gy * stride, height - 1)
        for gx in range(columns):
            if not points[gy, gx]:
                continue
            x = min(gx * stride, width - 1)
            blurred[gy, gx] = grid[gy, gx]
            if material[y, x] != METAL:
                continue
            total = f32(0)
            red = green = blue = f32(0)
            for j in range(max(gy - steps, 0), min(gy + steps + 1, rows)):
                v = min(j * stride, height - 1)
                for i in range(max(gx - steps, 0), min(gx + steps + 1, columns)):
                    u = min(i * stride, width - 1)
                    if material[v, u] != METAL:
                        continue
                    k = f32(reach - abs(j - gy) * stride)
                    k *= f32(reach - abs(i - gx) * stride)
                    apart = depth[v, u] / depth[y, x] - f32(1)
                    k /= f32(1) + f32(100) * apart * apart
                    same = f32(0)
                    for c in range(3):
                        same += normal[y, x, c] * normal[v, u, c]
                    k *= max(same, f32(0))
                    total += k
                    red += k * grid[j, i, 0]
                    green += k * grid[j, i, 1]
                    blue += k * grid[j, i, 2]
            blurred[gy, gx, 0] = red / total
            blurred[gy, gx, 1] = green / total
            blurred[gy, gx, 2] = blue / total
