"""How much what lies between a tool's jaws resists their closing."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surgery.kernels.distance_field import affine, air_mm, spacing_of
from surgery.kernels.touch_force import BONE_MM, BREAK_N, HARD, MUCOSA_MM, SOFT, Patch

Doubles = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def squeeze_jaws(
    patch: Patch, walls: Doubles, grounds: Doubles, points: Doubles, pose: Doubles,
    gape_mm: float, jaw: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the force on closing jaws, N, and the thickness held between them, mm.

    points: ``(n, 3)``, evenly in what wide open jaws enclose, in the tool's frame.
    pose: 4x4, mm from the tool. gape_mm: between the jaws, wide open. jaw: 0 open, 1
    closed. walls, grounds: as `touch_tick` has them. What the tool broke fills them.

    The share of the points that tissue fills is its thickness. Jaws that are nearer
    press it together; bone among it bears no more than breaks it.
    """
    held = stiff = bears = 0.0
    m = patch.voxel
    h = spacing_of(m)
    for n in range(points.shape[0]):
        x, y, z = affine(pose, points[n, 0], points[n, 1], points[n, 2])
        share = 0.5 - air_mm(patch.distance, m, x, y, z) / h
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
