"""A rigid triangle mesh in the picture: instruments and markers.

The mesh is met by the camera's own rays, so that its depth can be compared with the
tissue's pixel by pixel, under any lens.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from renderers.scene.camera import Camera, Projection
from renderers.scene.facets import Facets
from renderers.scene.gbuffer import GBuffer, Material
from renderers.scene.spine import Spine
from system import UserError

if TYPE_CHECKING:
    from renderers.scene.mesh_drawing import ListedFacets, RowRunner


def run_at_once(rows: int, kernel: Callable[[int, int], None]) -> None:
    """Run a kernel over all rows in this thread."""
    kernel(0, rows)


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles of one material.

    vertices: ``(n, 3)`` float64, mm, in the mesh's own frame.
    faces: ``(m, 3)`` int32 vertex indices, counter-clockwise seen from outside.
    capsules: ``(k, 7)`` float64, start, end and radius of what casts its shadow, mm;
        None to find it from the surface, which does for long round tools.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    material: Material = Material.METAL
    capsules: NDArray[np.float64] | None = None
    _facets: list[Facets] = field(default_factory=list, repr=False, compare=False)
    _spine: list[Spine] = field(default_factory=list, repr=False, compare=False)

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64)
        faces = np.array(self.faces, dtype=np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not len(vertices):
            raise UserError(f"mesh vertices must be (n, 3), got {vertices.shape}")
        if not np.all(np.isfinite(vertices)):
            raise UserError("mesh vertices must be finite")
        if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
            raise UserError(f"mesh faces must be (m, 3), got {faces.shape}")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise UserError(
                f"mesh faces name vertex {faces.max()} of {len(vertices)} vertices"
            )
        if self.capsules is not None:
            capsules = np.array(self.capsules, np.float64)
            if capsules.ndim != 2 or capsules.shape[1] != 7 or not len(capsules):
                raise UserError(f"mesh capsules must be (k, 7), got {capsules.shape}")
            if not (np.all(np.isfinite(capsules)) and np.all(capsules[:, 6] > 0)):
                raise UserError("mesh capsules must be finite, their radii positive")
            capsules.flags.writeable = False
            object.__setattr__(self, "capsules", capsules)
        vertices.flags.writeable = False
        faces.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)
        object.__setattr__(self, "material", Material(self.material))

    def gbuffer(self, camera: Camera, world_from_mesh: NDArray[np.float64]) -> GBuffer:
        """Return what the camera sees of the mesh, placed by a rigid 4x4 transform.

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
        run: "RowRunner" = run_at_once,
    ) -> None:
        """Draw the mesh into `buffer` where it is nearer than what is there.

        run: shares the rows out; the bits do not depend on how. Rays are followed only
        through the parts of the picture that a triangle can cover: what is not in view
        costs next to nothing.
        """
        if buffer.size != (camera.height, camera.width):
            raise UserError(
                f"a G-buffer of {buffer.size} does not fit a picture of "
                f"{(camera.height, camera.width)}"
            )
        self.listed(camera, world_from_mesh).draw(buffer, run)

    def listed(
        self, camera: Camera, world_from_mesh: NDArray[np.float64]
    ) -> "ListedFacets":
        """List what a view may show of the mesh; `draw` it when there is a buffer.

        Nothing of a solid that the eye is in.
        """
        # Imported here: pictures without instruments need not load the compiler.
        from renderers.scene.mesh_drawing import list_facets_in_view

        facets = self.facets()
        listed = list_facets_in_view(
            facets, int(self.material), camera, world_from_mesh
        )
        has_eye = facets.is_closed and camera.projection is not Projection.ORTHOGRAPHIC
        if has_eye and self.spine(world_from_mesh).holds(camera.eye_mm):
            return replace(listed, lists=[])
        return listed

    def spine(self, world_from_mesh: NDArray[np.float64]) -> Spine:
        """Return what casts the mesh's shadow, placed by a rigid 4x4 transform.

        The same mesh has the same capsules, to the bit, wherever it is loaded.
        """
        if not self._spine and self.capsules is not None:
            self._spine.append(Spine.of(self.capsules))
        elif not self._spine:
            pieces = self.facets().pieces.astype(np.float64).reshape(-1, 3, 3)
            sides = pieces[:, 1:] - pieces[:, :1]
            area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
            self._spine.append(Spine.through(pieces.mean(axis=1), area))
        return self._spine[0].placed(world_from_mesh)

    def facets(self) -> Facets:
        """Return the triangles as the kernels want them; the first call cuts them."""
        if not self._facets:
            self._facets.append(Facets.of(self.vertices[self.faces]))
        return self._facets[0]


PlacedMesh = tuple[Mesh, NDArray[np.float64]]
"""A mesh with its rigid 4x4 world-from-mesh transform."""
