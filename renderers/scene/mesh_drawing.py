"""A mesh's triangles drawn into a G-buffer."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene.camera import Camera, Projection
from renderers.scene.facets import Facets
from renderers.scene.gbuffer import GBuffer
from renderers.scene.kernels.fill_triangles import fill_facets
from renderers.scene.kernels.triangle_normals import DrawnPixels, resolve_facets
from renderers.scene.kernels.triangles import (
    CutMesh,
    LensBounds,
    bound_groups,
    list_facets,
)

RowRunner = Callable[[int, Callable[[int, int], None]], None]
"""Calls ``kernel(first, past_last)`` so that each of so many rows is covered once."""

ROOM = 4096
"""Triangles that are listed at a time."""

PLACE, BOX = 20, 5
"""Numbers that are listed of each."""


@dataclass(frozen=True, slots=True)
class ListedFacets:
    """What of a mesh a view may show.

    turn, shift: camera from mesh. rows: of the picture, first and past the last. lists:
    places and boxes of triangles, and how many, as `list_facets` gives them; none
    where the mesh is out of view.
    """

    facets: Facets
    material: int
    camera: Camera
    turn: NDArray[np.float64]
    shift: NDArray[np.float64]
    rows: tuple[int, int]
    lists: list[tuple[NDArray[np.float64], NDArray[np.int32], int]]

    def draw(self, buffer: GBuffer, run: RowRunner) -> None:
        """Draw triangles where they are nearer; see `Mesh.draw`."""
        if not self.lists:
            return
        facets, camera = self.facets, self.camera
        axes = np.ascontiguousarray(camera.frame[1:])
        owner = np.empty(buffer.size, np.int32)
        lens = camera.lens_table()
        flat = camera.projection is Projection.ORTHOGRAPHIC
        top, bottom = self.rows

        def rows(first: int, last: int) -> None:
            first, last = first + top, last + top
            owner[first:last] = -1
            left, right = camera.width, 0
            for places, boxes, count in self.lists:
                least, most = fill_facets(
                    places,
                    boxes,
                    count,
                    flat,
                    lens,
                    buffer.depth_mm,
                    owner,
                    first,
                    last,
                )
                left, right = min(left, least), max(right, most)
            resolve_facets(
                facets.corners,
                facets.normals,
                self.turn,
                self.shift,
                int(camera.projection),
                axes,
                lens,
                owner,
                self.material,
                DrawnPixels(buffer.normal, buffer.coverage, buffer.material),
                (first, last),
                (left, right),
            )

        run(bottom - top, rows)


def list_facets_in_view(
    facets: Facets,
    material: int,
    camera: Camera,
    world_from_mesh: NDArray[np.float64],
) -> ListedFacets:
    """List the triangles that a view may show.

    Asks the camera alone, so that it may be done before anything else is drawn.
    """
    axes = np.ascontiguousarray(camera.frame[1:])
    turn = axes @ world_from_mesh[:3, :3]
    shift = axes @ (world_from_mesh[:3, 3] - camera.frame[0])
    pinhole = camera.projection is Projection.PERSPECTIVE
    # the corners of a pinhole's picture are further out than its sides
    widest = math.pi / 2 if pinhole else camera.widest
    lens = LensBounds(
        int(camera.projection),
        widest,
        camera.pixels_per_unit,
        camera.distortion.stretches(camera.widest),
        camera.width,
        camera.height,
    )
    groups = np.empty((len(facets.spheres), 2), np.int32)
    bound_groups(facets.spheres, turn, shift, lens, groups)
    if not camera.distortion.is_none:
        # where groups appear is bounded for undistorted lenses only
        groups[:] = 0, camera.height
    seen = groups[groups[:, 1] > groups[:, 0]]
    if not len(seen):
        return ListedFacets(facets, material, camera, turn, shift, (0, 0), [])
    top, bottom = int(seen[:, 0].min()), int(seen[:, 1].max())
    flat = camera.projection is Projection.ORTHOGRAPHIC
    front = 0.0
    if facets.is_closed and not flat:
        # from outside a solid hides its own far side; from within it is not drawn
        front = -float(np.linalg.det(turn))
    mesh = CutMesh(facets.corners, facets.pieces, facets.parent, facets.first)
    # all at once, not row by row: to look through what is in view takes long
    lists = []
    piece = 0
    while piece < len(facets.pieces):
        places = np.empty((ROOM, PLACE), np.float64)
        boxes = np.empty((ROOM, BOX), np.int32)
        piece, count = list_facets(
            mesh, groups, turn, shift, lens, front, piece, places, boxes
        )
        lists.append((places, boxes, count))
    return ListedFacets(facets, material, camera, turn, shift, (top, bottom), lists)
