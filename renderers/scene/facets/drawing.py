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
    list_facets,
    resolve_facets,
)
from renderers.scene.gbuffer import GBuffer
from renderers.scene.mesh import RowRunner
from renderers.simd_guard import vector_problem

ROOM = 1024
"""Triangles that are listed at a time."""

PLACE, BOX = 20, 5
"""Numbers that are listed of each."""


@cache
def best_fill() -> Callable[..., None]:
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
    fill: Callable[..., None] | None = None,
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
    stretches = camera.distortion.stretches(camera.widest)
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
    owner = np.full(buffer.size, -1, np.int32)
    lens = camera.lens_table()

    def rows(first: int, last: int) -> None:
        first, last = first + top, last + top
        places = np.empty((ROOM, PLACE), np.float64)
        boxes = np.empty((ROOM, BOX), np.int32)
        left, right = camera.width, 0
        piece = 0
        while piece < len(facets.pieces):
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
                first,
                last,
                piece,
                places,
                boxes,
            )
            if count:
                flat = projection == Projection.ORTHOGRAPHIC
                fill(places, boxes, count, flat, lens, buffer.depth_mm, owner)
                left = min(left, int(boxes[:count, 1].min()))
                right = max(right, int(boxes[:count, 2].max()) + 1)
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
