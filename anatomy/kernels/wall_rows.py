"""Which wall each voxel belongs to."""

import numpy as np
from numba import njit

from anatomy.kernels.tables import Bytes, Floats, Grids, Shorts

NONE = 255
"""Of parts, structures and plates: there is none."""


@njit(cache=True, nogil=True, error_model="numpy")
def wall_rows(
    first: int,
    last: int,
    g: Grids,
    lookup: Shorts,
    ground_class: Bytes,
    out: Shorts,
) -> None:
    """Write the row of the wall that each voxel of some slices belongs to.

    lookup: ``(parts + structures, plates + 1, classes)`` rows; the last plate is
    none. ground_class: ``(parts, 256)`` class of a ground label behind a part. -1
    where no air is near.
    """
    parts, plates = ground_class.shape[0], lookup.shape[1] - 1
    for z in range(first, last):
        for y in range(out.shape[1]):
            for x in range(out.shape[2]):
                p, s, q = g.part[z, y, x], g.structure[z, y, x], g.plate[z, y, x]
                if p == NONE:
                    out[z, y, x] = -1
                    continue
                base = parts + int(s) if s != NONE else int(p)
                plate = int(q) if q != NONE else plates
                behind = ground_class[p, g.ground[z, y, x]]
                out[z, y, x] = lookup[base, plate, behind]


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_hazard(
    rows: Shorts,
    reach: Floats,
    hazard: Shorts,
    distance: Floats,
    unit: np.float32,
    least: Shorts,
    held: Bytes,
    number: int,
) -> None:
    """Keep a hazard where it is the nearest one that a voxel's wall stands before.

    reach: mm from the air to the far side of each row's bone, and what may lie
    between it and a hazard. least, held: the nearest hazard's distance so far and its
    number.
    """
    flat_rows, flat_hazard = rows.ravel(), hazard.ravel()
    flat_distance, flat_least = distance.ravel(), least.ravel()
    flat_held = held.ravel()
    for i in range(flat_rows.size):
        row, near = flat_rows[i], flat_hazard[i]
        if row < 0 or near >= flat_least[i]:
            continue
        depth = max(flat_distance[i], np.float32(0))
        if depth + np.float32(near) * unit <= reach[row]:
            flat_least[i], flat_held[i] = near, number


@njit(cache=True, nogil=True, error_model="numpy")
def spread(rows: Shorts, distance: Floats, farthest: np.float32, rounds: int) -> None:
    """Give voxels without a row the row of a neighbour nearer to the air, in place.

    Only up to `farthest` mm from the air, in `rounds` steps of a voxel.
    """
    nz, ny, nx = rows.shape
    before = np.empty_like(rows)
    for _ in range(rounds):
        before[:] = rows
        changed = False
        for z in range(nz):
            for y in range(ny):
                for x in range(nx):
                    d = distance[z, y, x]
                    if before[z, y, x] >= 0 or d >= farthest:
                        continue
                    best = d
                    for k in range(max(z - 1, 0), min(z + 2, nz)):
                        for j in range(max(y - 1, 0), min(y + 2, ny)):
                            for i in range(max(x - 1, 0), min(x + 2, nx)):
                                if before[k, j, i] >= 0 and distance[k, j, i] < best:
                                    best = distance[k, j, i]
                                    rows[z, y, x] = before[k, j, i]
                                    changed = True
        if not changed:
            return
