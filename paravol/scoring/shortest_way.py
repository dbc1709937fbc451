"""The shortest way of a scope's tip through the air of a head."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from renderers.scene import Volume

_LOOSEST = 0.25
"""A scope that dents tissue passes where less air is than its radius: down to this
share of the radius, ways are tried."""

_SIGHT_MM = 0.25
"""Between points of a straight line at which the air is read."""

_REACH_MM = 3.0
"""A place in tissue, dented by the scope, is taken for the nearest air so near."""


def inside_of(distance: Volume, points_mm: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points ``(n, 3)`` lie within a volume's grid."""
    matrix = distance.voxel_from_world
    index = points_mm @ matrix[:3, :3].T + matrix[:3, 3]
    last = np.array(distance.shape[::-1]) - 1
    return np.asarray(((index >= 0) & (index <= last)).all(axis=1), np.bool_)


def shortest_way_mm(
    distance: Volume, places_mm: NDArray[np.float64], radius_mm: float
) -> float | None:
    """Return the length of the shortest way from place to place ``(n, 3)``, in order.

    distance: signed air distance, mm, negative in air. The tip keeps `radius_mm` from
    tissue; where no such way is, less is tried. None where there is none at all.
    From voxel to voxel (Dijkstra), then pulled straight where the air allows it.
    """
    keeping = radius_mm
    while keeping >= _LOOSEST * radius_mm:
        length = _way(distance, places_mm, keeping)
        if length is not None:
            return length
        keeping /= 2.0
    return None


class _Air(NamedTuple):
    """The free voxels' places ``(n, 3)``, world mm, and the ways between them."""

    points: NDArray[np.float64]
    graph: coo_array


_KEPT = 4
_airs: dict[tuple[int, float], tuple[Volume, _Air | None]] = {}
"""The newest airs, by the head's distance and the distance that is kept."""


def _air(distance: Volume, keeping_mm: float) -> _Air | None:
    """Return the air of a head, which its sessions share; None without any."""
    key = id(distance), keeping_mm
    # the volume is kept too: while it lives, no other has its number
    if key not in _airs:
        while len(_airs) >= _KEPT:
            del _airs[next(iter(_airs))]
        _airs[key] = distance, _made_air(distance, keeping_mm)
    return _airs[key][1]


def _made_air(distance: Volume, keeping_mm: float) -> _Air | None:
    free = np.flatnonzero(distance.values.ravel() <= -keeping_mm)
    if len(free) == 0:
        return None
    index = np.stack(np.unravel_index(free, distance.shape), axis=1)[:, ::-1]
    world = distance.world_from_voxel
    points = index @ world[:3, :3].T + world[:3, 3]
    return _Air(points, _graph(free, index, points, distance.shape))


def _way(
    distance: Volume, places_mm: NDArray[np.float64], keeping_mm: float
) -> float | None:
    air = _air(distance, keeping_mm)
    if air is None:
        return None
    nodes = []
    for place in places_mm:
        away = np.linalg.norm(air.points - place, axis=1)
        nearest = int(np.argmin(away))
        if away[nearest] > _REACH_MM:
            return None
        nodes.append(nearest)
    total = 0.0
    for first, last in pairwise(nodes):
        chain = _chain(air, first, last)
        if chain is None:
            return None
        total += _pulled_mm(distance, air.points[chain], keeping_mm)
    return total


def _chain(air: _Air, first: int, last: int) -> list[int] | None:
    """Return the nodes of the shortest way from node to node; None if there is none."""
    straight_mm = float(np.linalg.norm(air.points[last] - air.points[first]))
    # a way within the limit is the shortest of all; the air around the head is not
    # gone through for it
    for limit_mm in (1.3 * straight_mm + 5.0, 2.0 * straight_mm + 30.0, np.inf):
        lengths, before = dijkstra(
            air.graph, indices=first, return_predecessors=True, limit=limit_mm
        )
        if np.isfinite(lengths[last]):
            chain = [last]
            while chain[-1] != first:
                chain.append(int(before[chain[-1]]))
            return chain
    return None


def _graph(
    free: NDArray[np.intp],
    index: NDArray[np.intp],
    points: NDArray[np.float64],
    shape: tuple[int, int, int],
) -> coo_array:
    """Join each free voxel to its free neighbours, corners included."""
    number = np.full(shape[0] * shape[1] * shape[2], -1, np.int32)
    number[free] = np.arange(len(free), dtype=np.int32)
    number = number.reshape(shape)
    rows, columns = [], []
    offsets = [
        (i, j, k)
        for k in (0, 1)
        for j in (-1, 0, 1)
        for i in (-1, 0, 1)
        if (k, j, i) > (0, 0, 0)
    ]
    last = np.array(shape[::-1]) - 1
    for offset in offsets:
        beside = index + offset
        inside = np.flatnonzero(((beside >= 0) & (beside <= last)).all(axis=1))
        i, j, k = beside[inside].T
        other = number[k, j, i]
        is_free = other >= 0
        rows.append(inside[is_free])
        columns.append(other[is_free])
    row, column = np.concatenate(rows), np.concatenate(columns)
    weight = np.linalg.norm(points[row] - points[column], axis=1)
    both = np.concatenate([row, column]), np.concatenate([column, row])
    size = len(free), len(free)
    return coo_array((np.concatenate([weight, weight]), both), shape=size).tocsr()


def _pulled_mm(
    distance: Volume, chain: NDArray[np.float64], keeping_mm: float
) -> float:
    """Return the length of a chain of points, straight where the air is free."""
    total, at = 0.0, 0
    while at < len(chain) - 1:
        # the farthest point in sight, found by bisection: sight seldom comes back
        near, far = at + 1, len(chain) - 1
        while near < far:
            middle = (near + far + 1) // 2
            if _in_sight(distance, chain[at], chain[middle], keeping_mm):
                near = middle
            else:
                far = middle - 1
        total += float(np.linalg.norm(chain[near] - chain[at]))
        at = near
    return total


def _in_sight(
    distance: Volume,
    begin: NDArray[np.float64],
    end: NDArray[np.float64],
    keeping_mm: float,
) -> bool:
    count = int(np.linalg.norm(end - begin) / _SIGHT_MM) + 2
    share = np.linspace(0.0, 1.0, count)[:, None]
    read = distance.sample(begin + share * (end - begin))
    return bool((read <= -keeping_mm).all())
