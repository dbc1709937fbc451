"""How much what lies between a tool's jaws resists their closing."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surgery.kernels.touch_force import (
    BONE_MM,
    BREAK_N,
    HARD,
    MUCOSA_MM,
    SOFT,
    Patch,
    air_mm,
)

Doubles = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def squeeze_jaws(
    patch: Patch, walls: Doubles, grounds: Doubles, points: Doubles, pose: Doubles,
    gape_mm: float, jaw: float, holes: Doubles,
) -> tuple[float, float]:  # fmt: skip
    """Return the force on closing jaws, N, and the thickness held between them, mm.

    points: ``(n, 3)``, evenly in what wide open jaws enclose, in the tool's frame.
    pose: 4x4, mm from the tool. gape_mm: between the jaws, wide open. jaw: 0 open, 1
    closed. walls, grounds: as `touch_tick` has them; holes: none of them count.

    The share of the points that tissue fills is its thickness. Jaws that are nearer
    press it together; bone among it bears no more than breaks it.
    """
    held = stiff = bears = 0.0
    m = patch.voxel
    h = 1.0 / math.sqrt(m[0, 0] ** 2 + m[1, 0] ** 2 + m[2, 0] ** 2)
    for n in range(points.shape[0]):
        a, b, c = points[n, 0], points[n, 1], points[n, 2]
        x = pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c + pose[0, 3]
        y = pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c + pose[1, 3]
        z = pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c + pose[2, 3]
        share = 0.5 - air_mm(patch.distance, m, holes, 0, x, y, z) / h
        share = min(max(share, 0.0), 1.0)
        if share == 0.0:
            continue
        i = int(m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3] + 0.5)
        j = int(m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3] + 0.5)
        k = int(m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3] + 0.5)
        wall = walls[patch.wall[k, j, i]]
        depth = patch.pristine[k, j, i]
        if depth < wall[MUCOSA_MM]:
            stiffness = wall[SOFT]
        elif depth < wall[MUCOSA_MM] + wall[BONE_MM]:
            stiffness = wall[HARD]
            bears = max(bears, wall[BREAK_N])
        else:
            stiffness = grounds[patch.ground[k, j, i]]
        held += share
        stiff += share * stiffness
    if held == 0.0:
        return 0.0, 0.0
    thickness = gape_mm * held / points.shape[0]
    force = stiff / held * max(thickness - gape_mm * (1.0 - jaw), 0.0)
    if bears > 0.0:
        force = min(force, bears)
    return force, thickness
