"""A rigid triangle mesh in the picture: instruments and markers.

The mesh is hit by the camera's own rays, so that its depth can be compared with the
tissue's pixel by pixel, under any lens.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene.camera import Camera, Projection
from renderers.scene.gbuffer import GBuffer, Material

_MARGIN_PX = 2
"""Border added to the mesh's bounding box in the picture."""

_BULGE = 0.25
"""Under the equidistant lens the picture of a straight edge is an arc. Its curvature is
(t - sin t cos t) / t**2 <= 0.64 per radian at the angle t <= pi/2 from the axis, its
length at most pi/2 times the angle L it subtends, its height over the chord therefore
at most 0.64 (pi L / 2)**2 / 8 = 0.2 L**2."""


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

        Rays are cast inside the projected bounding box only. Normals face the eye.
        """
        buffer = GBuffer.empty(camera.height, camera.width)
        rotation = world_from_mesh[:3, :3]
        world = self.vertices @ rotation.T + world_from_mesh[:3, 3]
        box = self._box(camera, world)
        if box is None:
            return buffer
        rows, columns = box
        table = camera.lens_table()[rows, columns].astype(np.float64)
        # Hit in the mesh's frame: the acceleration tree is then built once.
        mesh_from_camera = camera.frame[1:] @ rotation
        eye = (camera.frame[0] - world_from_mesh[:3, 3]) @ rotation
        if camera.projection is Projection.ORTHOGRAPHIC:
            origins = eye + table[..., :2] @ mesh_from_camera[:2]
            directions = np.broadcast_to(mesh_from_camera[2], origins.shape)
        else:
            directions = table @ mesh_from_camera
            origins = np.broadcast_to(eye, directions.shape)
        seen = np.linalg.norm(directions, axis=-1) > 0.5
        hit = self._intersector().run(
            np.ascontiguousarray(origins[seen], dtype=np.float32),
            np.ascontiguousarray(directions[seen], dtype=np.float32),
            output=True,
        )
        face = hit["geomID"] != -1
        normal = hit["Ng"].astype(np.float64) @ rotation.T
        length = np.linalg.norm(normal, axis=-1, keepdims=True)
        normal = np.divide(normal, length, where=length > 0, out=np.zeros_like(normal))
        view = directions[seen] @ rotation.T
        normal *= np.where(np.sum(normal * view, axis=-1) > 0, -1.0, 1.0)[:, None]
        for target, value in (
            (buffer.depth_mm, np.where(face, hit["tfar"], np.inf)),
            (buffer.coverage, face),
            (buffer.material, np.where(face, self.material, 0)),
            (buffer.normal, np.where(face[:, None], normal, 0)),
        ):
            target[rows, columns][seen] = value
        return buffer

    def _box(
        self, camera: Camera, world: NDArray[np.float64]
    ) -> tuple[slice, slice] | None:
        pixel, _ = camera.project(world)
        local_z = (world - camera.frame[0]) @ camera.frame[3]
        if np.any(local_z <= 0) or not np.all(np.isfinite(pixel)):
            # The mesh reaches behind the eye: no projection bounds it.
            return slice(0, camera.height), slice(0, camera.width)
        margin = _MARGIN_PX
        if camera.projection is Projection.EQUIDISTANT:
            rays = world - camera.frame[0]
            rays /= np.linalg.norm(rays, axis=1, keepdims=True)
            corners = rays[self.faces]
            edges = corners - np.roll(corners, 1, axis=1)
            chord = float(np.linalg.norm(edges, axis=2).max())
            angle = 2 * math.asin(min(1.0, chord / 2))
            margin += math.ceil(_BULGE * angle**2 / camera.radians_per_pixel)
        low = np.floor(pixel.min(axis=0)).astype(int) - margin
        high = np.ceil(pixel.max(axis=0)).astype(int) + margin
        size = np.array([camera.width, camera.height])
        low, high = np.maximum(low, 0), np.minimum(high, size)
        if np.any(low >= high):
            return None
        return slice(low[1], high[1]), slice(low[0], high[0])

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
