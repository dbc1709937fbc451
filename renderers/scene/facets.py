"""A mesh's triangles as the kernels want them: cut, and in groups."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_EDGE_MM = 1.0
"""Triangles are cut until no edge is longer: a thin one that crosses the picture at a
slant would be looked for in a wide box."""

_EDGES_ACROSS = 80
"""Edges that a large mesh may have along the root of its area."""

_GROUP_EDGES = 2.0
"""Size, in edges, of the cells whose triangles are turned down together."""

_CREASE_COSINE = 0.7
"""Faces that meet at less than 45 degrees are parts of one round surface."""


@dataclass(frozen=True, slots=True)
class Facets:
    """A mesh's triangles as the kernels want them.

    corners, normals: ``(n, 9)`` float32, triangles and their corners' normals.
    pieces, parent: ``(m, 9)`` float32 and ``(m,)`` int32; where triangles are looked
    for: small triangles that together cover the large ones, and whose they are.
    spheres: ``(g, 4)`` float32, centre and radius of ``pieces[first[g]:first[g + 1]]``.
    is_closed: whether they bound solids, so that none is to be seen from behind.
    """

    corners: NDArray[np.float32]
    normals: NDArray[np.float32]
    pieces: NDArray[np.float32]
    parent: NDArray[np.int32]
    spheres: NDArray[np.float32]
    first: NDArray[np.int32]
    is_closed: bool

    @classmethod
    def of(cls, corners: NDArray[np.float64]) -> "Facets":
        """Cut and group triangles ``(n, 3, 3)``."""
        place = _places(corners)
        sides = corners[:, 1:] - corners[:, :1]
        area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2
        edge = max(_EDGE_MM, math.sqrt(area) / _EDGES_ACROSS)
        pieces, parent = _cut(corners, edge)
        places = np.floor(pieces.mean(axis=1) / (_GROUP_EDGES * edge)).astype(np.int64)
        places -= places.min(axis=0)
        across = places.max(axis=0) + 1
        key = (places[:, 2] * across[1] + places[:, 1]) * across[0] + places[:, 0]
        order = np.lexsort((parent, key))
        pieces, parent = pieces[order], parent[order]
        first = np.flatnonzero(np.diff(key[order], prepend=-1))
        low = np.minimum.reduceat(pieces.min(axis=1), first, axis=0)
        high = np.maximum.reduceat(pieces.max(axis=1), first, axis=0)
        # a hair more than the half diagonal: what follows is rounded
        radius = np.linalg.norm(high - low, axis=1, keepdims=True) * 0.50001
        return cls(
            np.ascontiguousarray(corners, np.float32).reshape(-1, 9),
            _corner_normals(corners, place).astype(np.float32).reshape(-1, 9),
            np.ascontiguousarray(pieces, np.float32).reshape(-1, 9),
            parent.astype(np.int32),
            np.concatenate([(low + high) / 2, radius], axis=1).astype(np.float32),
            np.append(first, len(pieces)).astype(np.int32),
            _is_closed(corners, place),
        )


def _corner_normals(
    corners: NDArray[np.float64], place: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Return a unit normal for each corner ``(n, 3, 3)`` of triangles ``(n, 3, 3)``.

    It is the mean of the faces that share the place and do not meet at a crease, each
    weighted by its angle there: how a flat part is cut into triangles does not matter.
    """
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    ahead = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    angle = np.arctan2(
        np.linalg.norm(np.cross(ahead, back), axis=2),
        np.einsum("nij,nij->ni", ahead, back),
    ).ravel()
    owner = np.arange(len(place)) // 3
    order = np.argsort(place, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(place[order])) + 1)
    result = np.empty((len(place), 3))
    for group in groups:
        faces = flat[owner[group]]
        smooth = faces @ faces.T > _CREASE_COSINE
        result[group] = smooth @ (faces * angle[group, None])
    result /= np.maximum(np.linalg.norm(result, axis=1, keepdims=True), 1e-30)
    return result.reshape(-1, 3, 3)


def _places(corners: NDArray[np.float64]) -> NDArray[np.intp]:
    """Number the places ``(3 n,)`` of corners: a mesh may repeat its vertices."""
    _, place = np.unique(corners.reshape(-1, 3).round(6), axis=0, return_inverse=True)
    return place.ravel()


def _is_closed(corners: NDArray[np.float64], place: NDArray[np.intp]) -> bool:
    """Return whether each edge is passed once in each direction, round some volume."""
    place = place.reshape(-1, 3)
    ahead = np.roll(place, -1, axis=1)
    if np.any(place == ahead):
        return False
    most = int(place.max()) + 1
    there = np.sort((place * most + ahead).ravel())
    back = np.sort((ahead * most + place).ravel())
    once = bool(np.all(np.diff(there) > 0))
    return (
        once and np.array_equal(there, back) and float(np.linalg.det(corners).sum()) > 0
    )


def _cut(
    corners: NDArray[np.float64], longest_mm: float
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Cut triangles ``(n, 3, 3)`` until no edge is too long; say whose each piece is.

    A triangle is cut into strips along its two longer edges, all at once: halving one
    edge after the other would cut a thin one into splinters.
    """
    parent = np.arange(len(corners))
    done, owners = [], []
    while len(corners):
        edges = np.roll(corners, -1, axis=1) - corners
        length = np.linalg.norm(edges, axis=2)
        # begin with the corner between the longer edges
        index = np.arange(len(corners))
        tip = (length.argmin(axis=1) + 2) % 3
        a, b, c = (corners[index, (tip + k) % 3] for k in range(3))
        parts = np.maximum(np.ceil(length.max(axis=1) / longest_mm), 1).astype(int)
        whole = parts == 1
        done.append(corners[whole])
        owners.append(parent[whole])
        a, b, c, parts = a[~whole], b[~whole], c[~whole], parts[~whole]
        which = np.repeat(np.arange(len(parts)), parts)
        strip = np.arange(len(which)) - np.repeat(np.cumsum(parts) - parts, parts)
        near = (strip / parts[which])[:, None]
        far = ((strip + 1) / parts[which])[:, None]
        left, right = (b - a)[which], (c - a)[which]
        start = a[which]
        p, q = start + near * left, start + far * left
        r, s = start + far * right, start + near * right
        square = strip > 0
        corners = np.concatenate(
            [
                np.stack([p, q, r], axis=1),
                np.stack([p[square], r[square], s[square]], axis=1),
            ]
        )
        owner = parent[~whole][which]
        parent = np.concatenate([owner, owner[square]])
    return np.concatenate(done), np.concatenate(owners)
