"""A rigid triangle mesh in the picture: instruments and markers.

The mesh is hit by the camera's own rays, so that its depth can be compared with the
tissue's pixel by pixel, under any lens.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene.camera import STOP_MARGIN_PX, Camera, Projection
from renderers.scene.gbuffer import GBuffer, Material

_MARGIN_PX = 1.5
"""Border added round what the mesh covers, for rounding to whole pixels."""

_CELL_MM = 0.5
"""Edge of the cells whose triangles share a bounding sphere. Smaller ones bound an
instrument more tightly in the picture and cost more to project; a suction tube has
about a thousand spheres."""

_CELLS_ACROSS = 80
"""Cells that a large mesh may have along the root of its area."""

_CREASE_COSINE = 0.7
"""Faces that meet at less than 45 degrees are parts of one round surface."""

_OUTERMOST = 2.6
"""Angle from the view axis, radians, beyond which the bound of `_cover` says nothing:
theta / sin(theta) is 5 there and infinite straight behind the eye."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """Hold triangles of one material.

    vertices: ``(n, 3)`` float64, mm, in the mesh's own frame.
    faces: ``(m, 3)`` int32 vertex indices, counter-clockwise seen from outside.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    material: Material = Material.METAL
    _tree: list[Any] = field(default_factory=list, repr=False, compare=False)
    _spheres: list[Any] = field(default_factory=list, repr=False, compare=False)
    _normals: list[Any] = field(default_factory=list, repr=False, compare=False)

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
        """Hit the mesh, placed by a rigid 4x4 transform, with the camera's rays.

        Normals face the eye.
        """
        return self.draw(
            GBuffer.empty(camera.height, camera.width), camera, world_from_mesh
        )

    def draw(
        self, buffer: GBuffer, camera: Camera, world_from_mesh: NDArray[np.float64]
    ) -> GBuffer:
        """Draw the mesh into a copy of `buffer`, where it is nearer.

        Rays are cast only through the parts of the picture that the mesh can cover.
        """
        if buffer.size != (camera.height, camera.width):
            raise ValueError(
                f"a G-buffer of {buffer.size} does not fit a picture of "
                f"{(camera.height, camera.width)}"
            )
        rotation = world_from_mesh[:3, :3]
        # Hit in the mesh's frame: the acceleration tree is then built once.
        mesh_from_camera = camera.frame[1:] @ rotation
        eye = (camera.frame[0] - world_from_mesh[:3, 3]) @ rotation
        lens = camera.lens_table().reshape(-1, 3)
        covered = self._cover(camera, eye, mesh_from_camera).ravel()
        # The rays of the table are zero exactly where the lens sees nothing.
        pixels = np.flatnonzero(covered & (lens[:, 2] != 0))
        if not len(pixels):
            return buffer
        table = lens.take(pixels, axis=0)
        # Rounded to float32 last: the ray library takes no more.
        matrix, start = mesh_from_camera.astype(np.float32), eye.astype(np.float32)
        if camera.projection is Projection.ORTHOGRAPHIC:
            origins = start + table[:, :2] @ matrix[:2]
            directions = np.tile(matrix[2], (len(table), 1))
        else:
            directions = table @ matrix
            origins = np.tile(start, (len(table), 1))
        hit = self._intersector().run(origins, directions, output=True)
        before = buffer.depth_mm.take(pixels)
        nearer = np.flatnonzero((hit["geomID"] != -1) & (hit["tfar"] < before))
        pixels = pixels[nearer]
        normal = self._smooth_normals(hit, nearer)
        rays = directions.take(nearer, axis=0).astype(np.float64)
        flat = hit["Ng"].take(nearer, axis=0)
        normal[np.einsum("ij,ij->i", flat, rays) > 0] *= -1
        # At a silhouette the interpolated normal may look past the horizon.
        over = np.maximum(np.einsum("ij,ij->i", normal, rays) + 1e-3, 0)
        normal -= over[:, None] * rays
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
        result = GBuffer(
            buffer.depth_mm.copy(),
            buffer.normal.copy(),
            buffer.coverage.copy(),
            buffer.material.copy(),
        )
        result.depth_mm.reshape(-1)[pixels] = hit["tfar"].take(nearer)
        result.normal.reshape(-1, 3)[pixels] = normal @ rotation.T
        result.coverage.reshape(-1)[pixels] = 1
        result.material.reshape(-1)[pixels] = self.material
        return result

    def _smooth_normals(
        self, hit: dict[str, NDArray[Any]], which: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        """Interpolate the corners' normals at hits ``(k, 3)``; round things look so."""
        if len(self._normals) == 0:
            self._normals.append(_corner_normals(self.vertices[self.faces]))
        corners = self._normals[0][hit["primID"].take(which)]
        u, v = hit["u"].take(which)[:, None], hit["v"].take(which)[:, None]
        normal = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        result: NDArray[np.float64] = normal / np.maximum(length, 1e-30)
        return result

    def _cover(
        self,
        camera: Camera,
        eye: NDArray[np.float64],
        mesh_from_camera: NDArray[np.float64],
    ) -> NDArray[np.bool_]:
        """Mark the pixels ``(h, w)`` that the mesh can cover, and some more.

        The surface lies in small spheres; a sphere's directions are within
        ``asin(radius / distance)`` of its centre's. On the equidistant picture an
        angle grows by ``theta / sin(theta)`` at most.
        """
        everything = np.ones((camera.height, camera.width), np.bool_)
        if camera.projection is not Projection.EQUIDISTANT:
            return everything
        spheres = self._bounding_spheres()
        local = (spheres[:, :3] - eye) @ mesh_from_camera.T
        far = np.linalg.norm(local, axis=1)
        theta = np.arctan2(np.hypot(local[:, 0], local[:, 1]), local[:, 2])
        slip = np.arcsin(spheres[:, 3] / np.maximum(far, spheres[:, 3]))
        half = min(camera.width, camera.height) / 2
        widest = camera.extent * (1 + STOP_MARGIN_PX / half)
        seen = theta - slip < widest
        local, theta, slip = local[seen], theta[seen], slip[seen]
        if not seen.any():
            return ~everything
        outermost = np.minimum(theta + slip, _OUTERMOST)
        if np.any(theta + slip > _OUTERMOST):
            return everything
        pixels_per_radian = half / camera.extent
        grown = slip * outermost / np.maximum(np.sin(outermost), 1e-9)
        reach = grown * pixels_per_radian + _MARGIN_PX
        turn = np.arctan2(local[:, 1], local[:, 0])
        radius = theta * pixels_per_radian
        column = camera.width / 2 + radius * np.cos(turn)
        row = camera.height / 2 - radius * np.sin(turn)
        return _union_of_boxes(
            (column - reach, column + reach), (row - reach, row + reach), camera
        )

    def _bounding_spheres(self) -> NDArray[np.float64]:
        """Give spheres ``(k, 4)``, centre and radius, that hold the whole surface."""
        if len(self._spheres) == 0:
            corners = self.vertices[self.faces]
            sides = corners[:, 1:] - corners[:, :1]
            area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2
            cell = max(_CELL_MM, float(np.sqrt(area)) / _CELLS_ACROSS)
            corners = _split_longer_than(corners, cell)
            places = np.floor(corners.mean(axis=1) / cell).astype(np.int64)
            places -= places.min(axis=0)
            across = places.max(axis=0) + 1
            key = (places[:, 2] * across[1] + places[:, 1]) * across[0] + places[:, 0]
            order = np.argsort(key, kind="stable")
            first = np.flatnonzero(np.diff(key[order], prepend=-1))
            low = np.minimum.reduceat(corners.min(axis=1)[order], first, axis=0)
            high = np.maximum.reduceat(corners.max(axis=1)[order], first, axis=0)
            radius = np.linalg.norm(high - low, axis=1, keepdims=True) / 2
            self._spheres.append(np.concatenate([(low + high) / 2, radius], axis=1))
        spheres: NDArray[np.float64] = self._spheres[0]
        return spheres

    def _intersector(self) -> Any:
        if not self._tree:
            # Imported here: loading the ray library costs start-up time that
            # pictures without instruments need not pay.
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene

            scene = EmbreeScene()
            triangles = self.vertices[self.faces].astype(np.float32)
            TriangleMesh(scene, np.ascontiguousarray(triangles))
            self._tree.append(scene)
        return self._tree[0]


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


def _split_longer_than(
    corners: NDArray[np.float64], longest_mm: float
) -> NDArray[np.float64]:
    """Halve the longest edges of triangles ``(n, 3, 3)`` until none is too long."""
    done = []
    while len(corners):
        edges = np.roll(corners, -1, axis=1) - corners
        square = np.einsum("nij,nij->ni", edges, edges)
        which = square.argmax(axis=1)
        split = square.max(axis=1) > longest_mm**2
        done.append(corners[~split])
        corners, which = corners[split], which[split]
        index = np.arange(len(corners))
        a, b, c = (corners[index, (which + k) % 3] for k in range(3))
        middle = (a + b) / 2
        corners = np.concatenate(
            [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        )
    return np.concatenate(done)


def _union_of_boxes(
    columns: tuple[NDArray[np.float64], NDArray[np.float64]],
    rows: tuple[NDArray[np.float64], NDArray[np.float64]],
    camera: Camera,
) -> NDArray[np.bool_]:
    """Mark every pixel whose centre lies in one of the boxes, ``(h, w)``."""
    left, right = (np.clip(np.rint(c), 0, camera.width).astype(int) for c in columns)
    top, bottom = (np.clip(np.rint(r), 0, camera.height).astype(int) for r in rows)
    # Each box adds one to its pixels: corners into a table, two running sums.
    table = np.zeros((camera.height + 1, camera.width + 1), np.int32)
    for row, column, sign in (
        (top, left, 1),
        (top, right, -1),
        (bottom, left, -1),
        (bottom, right, 1),
    ):
        np.add.at(table, (row, column), sign)
    covered: NDArray[np.bool_] = table.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0
    return covered
