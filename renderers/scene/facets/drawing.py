"""A mesh's triangles drawn into a G-buffer."""

import math
from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from renderers.scene.camera import Camera, Projection
from renderers.scene.facets.facets import Facets
from renderers.scene.facets.kernels import (
    bound_groups,
    fill_facets,
    is_outside,
    list_facets,
)
from renderers.scene.facets.surfacing.kernels import resolve_facets
from renderers.scene.gbuffer import GBuffer
from renderers.scene.mesh import RowRunner
from renderers.simd_guard import vector_problem

ROOM = 4096
"""Triangles that are listed at a time."""

PLACE, BOX = 20, 5
"""Numbers that are listed of each."""


@cache
def best_fill() -> Callable[..., tuple[int, int]]:
    """Give the vector kernel where it can be trusted, else its scalar twin."""
    if vector_problem():
        return fill_facets
    from renderers.scene.facets.vector import kernels

    return kernels.fill_facets


def draw_facets(
    facets: Facets,
    material: int,
    buffer: GBuffer,
    camera: Camera,
    world_from_mesh: NDArray[np.float64],
    run: RowRunner,
    fill: Callable[..., tuple[int, int]] | None = None,
) -> None:
    """Draw triangles where they are nearer; see `Mesh.draw`.

    fill: one of the twins named `fill_facets`; by default the best.
    """
    fill = fill or best_fill()
    axes = np.ascontiguousarray(camera.frame[1:])
    turn = axes @ world_from_mesh[:3, :3]
    shift = axes @ (world_from_mesh[:3, 3] - camera.frame[0])
    pinhole = camera.projection is Projection.PERSPECTIVE
    # the corners of a pinhole's picture are further out than its sides
    widest = math.pi / 2 if pinhole else camera.widest
    projection = int(camera.projection)
    groups = np.empty((len(facets.spheres), 2), np.int32)
    bound_groups(
        facets.spheres,
        turn,
        shift,
        projection,
        widest,
        camera.pixels_per_unit,
        camera.height,
        groups,
    )
    if not camera.distortion.is_none:
        # where groups appear is bounded for undistorted lenses only
        groups[:] = 0, camera.height
    seen = groups[groups[:, 1] > groups[:, 0]]
    if not len(seen):
        return
    top, bottom = int(seen[:, 0].min()), int(seen[:, 1].max())
    owner = np.empty(buffer.size, np.int32)
    lens = camera.lens_table()
    flat = camera.projection is Projection.ORTHOGRAPHIC
    front = 0.0
    if facets.is_closed and not flat and is_outside(facets.corners, -shift @ turn):
        front = -float(np.linalg.det(turn))
    stretches = camera.distortion.stretches(camera.widest)
    # all at once, not row by row: to look through what is in view takes long
    lists = []
    piece = 0
    while piece < len(facets.pieces):
        places = np.empty((ROOM, PLACE), np.float64)
        boxes = np.empty((ROOM, BOX), np.int32)
        piece, count = list_facets(
            facets.corners,
            facets.pieces,
            facets.parent,
            facets.first,
            groups,
            turn,
            shift,
            projection,
            widest,
            camera.pixels_per_unit,
            stretches,
            camera.width,
            camera.height,
            front,
            piece,
            places,
            boxes,
        )
        lists.append((places, boxes, count))

    def rows(first: int, last: int) -> None:
        first, last = first + top, last + top
        owner[first:last] = -1
        left, right = camera.width, 0
        for places, boxes, count in lists:
            least, most = fill(
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
            turn,
            shift,
            projection,
            axes,
            lens,
            owner,
            material,
            buffer.normal,
            buffer.coverage,
            buffer.material,
            (first, last),
            (left, right),
        )

    run(bottom - top, rows)
