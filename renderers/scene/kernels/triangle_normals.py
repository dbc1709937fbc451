"""Compiled: normals of the triangles that own the pixels of a picture."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.scene.kernels.triangles import ORTHOGRAPHIC, edge_products, place
from renderers.simd.arrays import Bytes, Doubles, Floats, Ints, f32

SILHOUETTE = 1e-3
"""Least cosine between a smooth normal and the ray: at a silhouette the interpolated
normal may look past the horizon."""


class DrawnPixels(NamedTuple):
    """What is written of a picture's pixels."""

    normal: Floats
    coverage: Floats
    material: Bytes


@njit(cache=True, nogil=True, error_model="numpy")
def resolve_facets(
    corners: Floats, corner_normals: Floats, turn: Doubles, shift: Doubles,
    projection: int, axes: Doubles, lens: Floats, owner: Ints, material: int,
    drawn: DrawnPixels, rows: tuple[int, int], columns: tuple[int, int],
) -> None:  # fmt: skip
    """Write normal, coverage and material of the pixels that a triangle owns.

    corner_normals: ``(n, 9)``, mesh frame. axes: rows are the camera's axes, world.
    Normals face the eye.
    """
    normal, coverage, materials = drawn
    p = np.empty(9, np.float64)
    e = np.empty(12, np.float64)
    t = np.empty(9, np.float64)
    flat = projection == ORTHOGRAPHIC
    # right, up, forward is a left-handed frame: there cross products point inwards
    handed = turn[0, 0] * (turn[1, 1] * turn[2, 2] - turn[1, 2] * turn[2, 1])
    handed -= turn[0, 1] * (turn[1, 0] * turn[2, 2] - turn[1, 2] * turn[2, 0])
    handed += turn[0, 2] * (turn[1, 0] * turn[2, 1] - turn[1, 1] * turn[2, 0])
    qx, qy, qz = axes[0, 0], axes[0, 1], axes[0, 2]
    kx, ky, kz = axes[1, 0], axes[1, 1], axes[1, 2]
    ox, oy, oz = axes[2, 0], axes[2, 1], axes[2, 2]
    fx = fy = fz = 0.0
    known = -1
    for y in range(rows[0], rows[1]):
        for x in range(columns[0], columns[1]):
            n = owner[y, x]
            if n < 0:
                continue
            if n != known:
                known = n
                place(corners, n, turn, shift, p)
                edge_products(p, projection, e)
                # its corners' normals in the camera's frame
                for i in range(3):
                    for j in range(3):
                        t[3 * i + j] = (
                            turn[j, 0] * corner_normals[n, 3 * i]
                            + turn[j, 1] * corner_normals[n, 3 * i + 1]
                            + turn[j, 2] * corner_normals[n, 3 * i + 2]
                        )
                ax, ay, az = p[3] - p[0], p[4] - p[1], p[5] - p[2]
                bx, by, bz = p[6] - p[0], p[7] - p[1], p[8] - p[2]
                fx = handed * (ay * bz - az * by)
                fy = handed * (az * bx - ax * bz)
                fz = handed * (ax * by - ay * bx)
            dx, dy, dz = (
                float(lens[y, x, 0]),
                float(lens[y, x, 1]),
                float(lens[y, x, 2]),
            )
            u = dx * e[0] + dy * e[1] + dz * e[2]
            v = dx * e[3] + dy * e[4] + dz * e[5]
            w = dx * e[6] + dy * e[7] + dz * e[8]
            share = 1.0 / (u + v + w)
            v *= share
            w *= share
            u = 1.0 - v - w
            sx = u * t[0] + v * t[3] + w * t[6]
            sy = u * t[1] + v * t[4] + w * t[7]
            sz = u * t[2] + v * t[5] + w * t[8]
            rx = 0.0 if flat else dx
            ry = 0.0 if flat else dy
            # the side the eye is on, from the flat triangle
            side = -1.0 if rx * fx + ry * fy + dz * fz > 0 else 1.0
            side /= max(math.sqrt(sx * sx + sy * sy + sz * sz), 1e-30)
            sx *= side
            sy *= side
            sz *= side
            over = sx * rx + sy * ry + sz * dz + SILHOUETTE
            if over > 0:
                sx -= over * rx
                sy -= over * ry
                sz -= over * dz
                scale = 1 / max(math.sqrt(sx * sx + sy * sy + sz * sz), 1e-30)
                sx *= scale
                sy *= scale
                sz *= scale
            normal[y, x, 0] = f32(sx * qx + sy * kx + sz * ox)
            normal[y, x, 1] = f32(sx * qy + sy * ky + sz * oy)
            normal[y, x, 2] = f32(sx * qz + sy * kz + sz * oz)
            coverage[y, x] = f32(1)
            materials[y, x] = material
