"""Surfels moved by deflectors, as splats: places, normals and footprints.

The 1995 splatter could not show what its ray caster did with bent rays. A ray asks
which tissue it meets at x; a splat must know where its tissue q appears, the inverse of
the same map. With J = dq/dx there, a normal n becomes ``J^T n`` and a footprint's
covariance S becomes ``F S F^T``, F the inverse of J. Discs are all of one size: where a
footprint grows beyond it, the surface is covered by that many more of them.
"""

import math

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.sparse_rows import SparseRows
from renderers.fsr.surfels.surfel_set import Surfels, extract_surfels
from renderers.scene import Volume
from renderers.scene.deflection import Cut, Deflection, deflected_distance

GROWTH = 1.1
"""Growth of a footprint that neighbours still cover."""

SEAM_MM = 1.5
"""From a cut's faces; two discs' diameters at 0.5 mm."""

RIM_STEPS = 4
"""Grid steps in one of the distance's beside a cut, whose rims are sharp."""

MOST_REFINED = 4
"""Surfels per spacing are not multiplied by more than this: beyond, gaps may show."""


def displaced_normals(
    normals: NDArray[np.float64], jacobian: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the unit normals ``J^T n`` of moved surfaces; both ``(n, 3)``."""
    moved = np.einsum("nji,nj->ni", jacobian, normals)
    length = np.linalg.norm(moved, axis=1, keepdims=True)
    return np.asarray(moved / np.maximum(length, 1e-300))


def displaced_covariances(
    covariances: NDArray[np.float64], jacobian: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``F S F^T`` with F the inverse of J = dq/dx, ``(n, 3, 3)`` each."""
    forward = np.linalg.inv(jacobian)
    return np.asarray(forward @ covariances @ forward.transpose(0, 2, 1))


def largest_growth(
    normals: NDArray[np.float64], jacobian: NDArray[np.float64]
) -> float:
    """Return how much the widest footprint of tangent discs grows; 1 for none."""
    if len(normals) == 0:
        return 1.0
    discs = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    widest = np.linalg.eigvalsh(displaced_covariances(discs, jacobian))[:, 2]
    return math.sqrt(float(widest.max()))


def displace_surfels(
    surfels: Surfels, distance: Volume, deflection: Deflection
) -> Surfels:
    """Move surfels of a distance's surface to where a deflection shows them.

    Those outside its balls keep their bits. Beside a cut, where there is new surface
    and discs would stand out over sharp rims, they are found in the deformed distance.
    surfels: of the undeformed distance. The result is of the same grid.
    """
    first = surfels.rows.world_from_voxel[:3, 3]
    stays = ~deflection.moves(surfels.position + first)
    position, normal = _moved(surfels, distance, deflection)
    return _on_grid(
        surfels,
        np.concatenate([surfels.position[stays], (position - first)]),
        np.concatenate([surfels.normal[stays], normal]),
    )


def _moved(
    surfels: Surfels, distance: Volume, deflection: Deflection
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return places (world) and normals of what is in the balls, as dense as needed."""
    part = _around(distance, deflection)
    refine = round(float(distance.spacing_mm.max()) / surfels.spacing_mm)
    for times in range(1, MOST_REFINED + 1):
        q, normals = _within(part, deflection, refine * times)
        x = deflection.push_forward(q)
        jacobian = deflection.jacobian(x)
        growth = largest_growth(normals, jacobian)
        if growth <= GROWTH * times:
            break
    normals = displaced_normals(normals, jacobian)
    whole = deflection.opening(x) >= SEAM_MM
    if not any(isinstance(part, Cut) for part in deflection.deflectors):
        return x, normals
    deformed = deflected_distance(_finer(part, RIM_STEPS), deflection)
    rim, towards = _within(deformed, deflection, 1)
    near = deflection.opening(rim) < SEAM_MM
    return (
        np.concatenate([x[whole], rim[near]]),
        np.concatenate([normals[whole], towards[near]]),
    )


def _around(distance: Volume, deflection: Deflection) -> Volume:
    """Crop a volume to what holds a deflection's balls, and two voxels more."""
    inverse = distance.voxel_from_world
    top = np.array(distance.shape[::-1])
    low, high = top.copy(), np.zeros(3, int)
    for ball in deflection.deflectors:
        reach = ball.radius_mm * np.linalg.norm(inverse[:3, :3], axis=1) + 2
        middle = inverse[:3, :3] @ ball.center_mm + inverse[:3, 3]
        low = np.minimum(low, np.floor(middle - reach).astype(int))
        high = np.maximum(high, np.ceil(middle + reach).astype(int) + 1)
    low, high = np.clip(low, 0, top - 2), np.clip(high, 2, top)
    high = np.maximum(high, low + 2)
    (i0, j0, k0), (i1, j1, k1) = low, high
    matrix = distance.world_from_voxel
    return Volume(
        distance.values[k0:k1, j0:j1, i0:i1],
        distance.spacing_mm,
        matrix[:3, :3] @ low + matrix[:3, 3],
        distance.direction,
        distance.background,
    )


def _finer(volume: Volume, steps: int) -> Volume:
    """Read a volume's trilinear field `steps` times as densely."""
    values = volume.values.astype(np.float32)
    for axis in range(3):
        count = (values.shape[axis] - 1) * steps + 1
        below, rest = np.divmod(np.arange(count), steps)
        above = np.minimum(below + 1, values.shape[axis] - 1)
        share = (rest / np.float32(steps)).astype(np.float32)
        share = share.reshape([-1 if n == axis else 1 for n in range(3)])
        low, high = values.take(below, axis), values.take(above, axis)
        values = low + (high - low) * share
    return Volume(
        values,
        volume.spacing_mm / steps,
        volume.origin_mm,
        volume.direction,
        volume.background,
    )


def _within(
    part: Volume, deflection: Deflection, refine: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Find a surface's surfels in a deflection's balls: places (world) and normals."""
    found = extract_surfels(part, refine)
    q = found.position.astype(np.float64) + part.origin_mm
    inside = deflection.moves(q)
    return q[inside], found.normal[inside].astype(np.float64)


def _on_grid(
    like: Surfels, position: NDArray[np.float64], normal: NDArray[np.float64]
) -> Surfels:
    """Sort surfels into the rows of a grid by the grid points next to them."""
    rows = like.rows
    nz, ny, nx = rows.shape
    linear = rows.world_from_voxel[:3, :3]
    voxel = np.rint(position @ np.linalg.inv(linear).T).astype(np.int64)
    inside = np.all((voxel >= 0) & (voxel < np.array([nx, ny, nz])), axis=1)
    i, j, k = voxel[inside].T
    order = np.lexsort((i, j, k))
    counts = np.bincount(k * ny + j, minlength=nz * ny)
    return Surfels(
        SparseRows(
            rows.shape,
            rows.world_from_voxel.copy(),
            np.concatenate([[0], np.cumsum(counts)]),
            i[order].astype(np.uint16),
        ),
        position[inside][order].astype(np.float32),
        normal[inside][order].astype(np.float32),
        like.spacing_mm,
    )
