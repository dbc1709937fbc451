"""A rigid triangle mesh in the picture: instruments and markers.

The mesh is met by the camera's own rays, so that its depth can be compared with the
tissue's pixel by pixel, under any lens.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderers.scene.camera import STOP_MARGIN_PX, Camera, Projection
from renderers.scene.gbuffer import GBuffer, Material
from renderers.scene.spine import Spine

_EDGE_MM = 1.0
"""Triangles are cut until no edge is longer: a thin one that crosses the picture at a
slant would be looked for in a wide box."""

_EDGES_ACROSS = 80
"""Edges that a large mesh may have along the root of its area."""

_GROUP_EDGES = 2.0
"""Size, in edges, of the cells whose triangles are turned down together."""

_CREASE_COSINE = 0.7
"""Faces that meet at less than 45 degrees are parts of one round surface."""


RowRunner = Callable[[int, Callable[[int, int], None]], None]
"""Calls ``kernel(first, past_last)`` so that each of so many rows is covered once."""


def run_at_once(rows: int, kernel: Callable[[int, int], None]) -> None:
    """Run a kernel over all rows in this thread."""
    kernel(0, rows)


@dataclass(frozen=True, slots=True)
class _Facets:
    """Hold a mesh's triangles as the kernels want them.

    corners, normals: ``(n, 9)`` float32, triangles and their corners' normals.
    pieces, parent: ``(m, 9)`` float32 and ``(m,)`` int32; where triangles are looked
    for: small triangles that together cover the large ones, and whose they are.
    spheres: ``(g, 4)`` float32, centre and radius of ``pieces[first[g]:first[g + 1]]``.
    """

    corners: NDArray[np.float32]
    normals: NDArray[np.float32]
    pieces: NDArray[np.float32]
    parent: NDArray[np.int32]
    spheres: NDArray[np.float32]
    first: NDArray[np.int32]

    @classmethod
    def of(cls, corners: NDArray[np.float64]) -> "_Facets":
        """Cut and group triangles ``(n, 3, 3)``."""
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
            _corner_normals(corners).astype(np.float32).reshape(-1, 9),
            np.ascontiguousarray(pieces, np.float32).reshape(-1, 9),
            parent.astype(np.int32),
            np.concatenate([(low + high) / 2, radius], axis=1).astype(np.float32),
            np.append(first, len(pieces)).astype(np.int32),
        )


@dataclass(frozen=True, slots=True)
class Mesh:
    """Hold triangles of one material.

    vertices: ``(n, 3)`` float64, mm, in the mesh's own frame.
    faces: ``(m, 3)`` int32 vertex indices, counter-clockwise seen from outside.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    material: Material = Material.METAL
    _facets: list[_Facets] = field(default_factory=list, repr=False, compare=False)
    _spine: list[Spine] = field(default_factory=list, repr=False, compare=False)

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64)
        faces = np.array(self.faces, dtype=np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(vertices):
            raise ValueError(f"mesh vertices must be (n, 3), got {vertices.shape}")
        if not np.all(np.isfinite(vertices)):
            raise ValueError("mesh vertices must be finite")
        if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
            raise ValueError(f"mesh faces must be (m, 3), got {faces.shape}")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise ValueError(
                f"mesh faces name vertex {faces.max()} of {len(vertices)} vertices"
            )
        vertices.flags.writeable = False
        faces.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)
        object.__setattr__(self, "material", Material(self.material))

    def gbuffer(self, camera: Camera, world_from_mesh: NDArray[np.float64]) -> GBuffer:
        """Give what the camera sees of the mesh, placed by a rigid 4x4 transform.

        Normals face the eye.
        """
        result = GBuffer.empty(camera.height, camera.width)
        self.draw(result, camera, world_from_mesh)
        return result

    def draw(
        self,
        buffer: GBuffer,
        camera: Camera,
        world_from_mesh: NDArray[np.float64],
        run: RowRunner = run_at_once,
    ) -> None:
        """Draw the mesh into `buffer` where it is nearer than what is there.

        run: shares the rows out; the bits do not depend on how. Rays are followed only
        through the parts of the picture that a triangle can cover: what is not in view
        costs next to nothing.
        """
        # Imported here: pictures without instruments need not load the compiler.
        from renderers.scene.facets.kernels import draw_facets, resolve_facets

        if buffer.size != (camera.height, camera.width):
            raise ValueError(
                f"a G-buffer of {buffer.size} does not fit a picture of "
                f"{(camera.height, camera.width)}"
            )
        facets = self._cut_facets()
        axes = np.ascontiguousarray(camera.frame[1:])
        turn = axes @ world_from_mesh[:3, :3]
        shift = axes @ (world_from_mesh[:3, 3] - camera.frame[0])
        half = min(camera.width, camera.height) / 2
        pinhole = camera.projection is Projection.PERSPECTIVE
        unit = math.tan(camera.extent) if pinhole else camera.extent
        # the corners of a pinhole's picture are further out than its sides
        widest = math.pi / 2 if pinhole else unit * (1 + STOP_MARGIN_PX / half)
        owner = np.full(buffer.size, -1, np.int32)
        lens = camera.lens_table()
        projection = int(camera.projection)

        def rows(first: int, last: int) -> None:
            top, bottom, left, right = draw_facets(
                facets.corners,
                facets.pieces,
                facets.parent,
                facets.spheres,
                facets.first,
                turn,
                shift,
                projection,
                widest,
                half / unit,
                lens,
                buffer.depth_mm,
                owner,
                first,
                last,
            )
            resolve_facets(
                facets.corners,
                facets.normals,
                turn,
                shift,
                projection,
                axes,
                lens,
                owner,
                int(self.material),
                buffer.normal,
                buffer.coverage,
                buffer.material,
                (top, bottom),
                (left, right),
            )

        run(camera.height, rows)

    def spine(self, world_from_mesh: NDArray[np.float64]) -> Spine:
        """Give the rods that cast the mesh's shadow, placed by a rigid 4x4 transform.

        The same mesh has the same rods, to the bit, wherever it is loaded.
        """
        if not self._spine:
            pieces = self._cut_facets().pieces.astype(np.float64).reshape(-1, 3, 3)
            sides = pieces[:, 1:] - pieces[:, :1]
            area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
            self._spine.append(Spine.through(pieces.mean(axis=1), area))
        return self._spine[0].placed(world_from_mesh)

    def _cut_facets(self) -> _Facets:
        if not self._facets:
            self._facets.append(_Facets.of(self.vertices[self.faces]))
        return self._facets[0]


def _corner_normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give a unit normal for each corner ``(n, 3, 3)`` of triangles ``(n, 3, 3)``.

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
    # Corners at one place are joined by position: a mesh may repeat its vertices.
    _, place = np.unique(corners.reshape(-1, 3).round(6), axis=0, return_inverse=True)
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
