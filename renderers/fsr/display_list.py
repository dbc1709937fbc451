"""What a picture needs of a set, in the order in which to draw it.

Whole rows are clipped against the view, each by two binary searches (``n**2 log n``
for ``n**3`` voxels). The order comes from the grid at the eye: the slices on either
side of the eye's own slice are taken far to near, and so are the rows in a slice and
the elements in a row. No element precedes one that it could hide; nothing is sorted.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.cull_rows import cull_rows, list_spans
from renderers.fsr.sparse_rows import SparseRows
from renderers.fsr.view_limits import SOFT_PX, STEEPEST_CONE_RAD
from renderers.scene import Camera, Projection
from renderers.scene.camera import STOP_MARGIN_PX

CONE_SIDES = 8
"""Planes around the round field: eight waste 5 % of its area, four 27 %."""

_TURNS = 2 * math.pi * (np.arange(CONE_SIDES) + 0.5) / CONE_SIDES
_CONE = np.stack([np.cos(_TURNS), np.sin(_TURNS)], axis=1)
_SIDES = np.array([[-1.0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]])


@dataclass(frozen=True, slots=True)
class DisplayList:
    """Name the elements to draw.

    index: ``(n,)`` int32 into the set's arrays, far to near (or near to far when so
        asked). row: ``(n,)`` int32, each element's row ``k * ny + j``.
    rows_kept: rows that were not culled whole.
    """

    index: NDArray[np.int32]
    row: NDArray[np.int32]
    rows_kept: int

    def __len__(self) -> int:
        return len(self.index)


def view_planes(camera: Camera, margin_mm: float) -> NDArray[np.float64]:
    """Bound the view, and two pixels around it, by world planes ``(p, 4)``.

    A ball of radius `margin_mm` that touches the view has its centre on the positive
    side of all of them: row 0..2 are the unit normal, 3 the offset. The pixels are for
    footprints, which are softened by half a pixel.
    """
    lens = lens_planes(camera.projection, camera.extent, camera.width, camera.height)
    planes = np.empty_like(lens)
    np.matmul(lens[:, :3], camera.frame[1:], out=planes[:, :3])
    planes[:, 3] = lens[:, 3] + margin_mm - planes[:, :3] @ camera.eye_mm
    return planes


@lru_cache(maxsize=64)
def lens_planes(
    projection: Projection, extent: float, width: int, height: int
) -> NDArray[np.float64]:
    """Bound a view as `view_planes` does, in the camera's own frame.

    By right, up and forward, in mm from the eye, without a margin.
    """
    half = min(width, height) / 2
    wide, high = width / 2 / half, height / 2 / half
    wide += SOFT_PX / half
    high += SOFT_PX / half
    normals: NDArray[np.float64] = np.empty((0, 3))
    if projection is Projection.ORTHOGRAPHIC:
        offsets = extent * np.array([wide, wide, high, high])
        return np.column_stack([_SIDES, offsets])
    if projection is Projection.EQUIDISTANT:
        angle = extent * (1 + (STOP_MARGIN_PX + 1) / half)
        if angle < STEEPEST_CONE_RAD:
            normals = np.full((len(_CONE), 3), math.sin(angle))
            normals[:, :2] = -math.cos(angle) * _CONE
    else:
        slope = math.tan(extent)
        aside, above = slope * wide, slope * high
        normals = np.array(
            [[-1, 0, aside], [1, 0, aside], [0, -1, above], [0, 1, above], [0, 0, 1]]
        )
        normals /= np.sqrt((normals * normals).sum(axis=1, keepdims=True))
    return np.column_stack([normals, np.zeros(len(normals))])


def eye_voxel(rows: SparseRows, camera: Camera) -> NDArray[np.int64]:
    """Find the grid point (i, j, k) nearest to the eye, clamped into the grid.

    An orthographic eye is infinitely far back along the view axis.
    """
    voxel_from_world = np.linalg.inv(rows.world_from_voxel)
    top = np.array(rows.shape[::-1]) - 1
    if camera.projection is Projection.ORTHOGRAPHIC:
        along = voxel_from_world[:3, :3] @ camera.frame[3]
        return np.where(along < 0, top, 0)
    voxel = voxel_from_world[:3, :3] @ camera.eye_mm + voxel_from_world[:3, 3]
    return np.clip(np.rint(voxel), 0, top).astype(np.int64)


@dataclass(frozen=True, slots=True)
class ClippedRows:
    """Hold what the view leaves of a set's rows.

    spans: ``(k, 3)`` int32, a row ``k * ny + j`` and its first and last + 1 element,
        far rows first. count: elements in all of them.
    """

    spans: NDArray[np.int32]
    count: int


def clip_rows(
    rows: SparseRows,
    camera: Camera,
    margin_mm: float,
    *,
    reach_mm: float = math.inf,
    room: NDArray[np.int32] | None = None,
) -> ClippedRows:
    """Cull a set for one view, whole rows at a time.

    margin_mm: radius of an element; nothing that reaches into the view is lost.
    reach_mm: leave out elements whose grid point is farther from the eye.
    room: memory for the spans, ``(rows, 3)``.
    """
    matrix = rows.world_from_voxel
    # a plane a.p + d of the world is (a M) v + d of the voxel frame
    planes = np.ascontiguousarray(view_planes(camera, margin_mm) @ matrix)
    nz, ny, nx = rows.shape
    spans = np.empty((ny * nz, 3), np.int32) if room is None else room
    kept, count = cull_rows(
        rows.offsets,
        rows.x,
        nx,
        ny,
        nz,
        planes,
        matrix[:3, 3] - camera.eye_mm,
        np.ascontiguousarray(matrix[:3, :3].T),
        float(reach_mm),
        eye_voxel(rows, camera),
        spans,
    )
    return ClippedRows(spans[:kept], count)


def build_display_list(
    rows: SparseRows,
    camera: Camera,
    margin_mm: float,
    *,
    reach_mm: float = math.inf,
    back_to_front: bool = True,
) -> DisplayList:
    """Cull as `clip_rows` does, and give the elements that are left.

    back_to_front: far to near, else near to far.
    """
    clipped = clip_rows(rows, camera, margin_mm, reach_mm=reach_mm)
    index, row = np.empty((2, clipped.count), np.int32)
    eye_column = int(eye_voxel(rows, camera)[0])
    list_spans(clipped.spans, len(clipped.spans), rows.x, eye_column, index, row)
    if not back_to_front:
        index, row = np.ascontiguousarray(index[::-1]), np.ascontiguousarray(row[::-1])
    return DisplayList(index, row, len(clipped.spans))


def sorted_by_distance(
    shown: DisplayList, rows: SparseRows, camera: Camera
) -> DisplayList:
    """Order a far-to-near list by distance from the eye, ties as they are.

    In a perspective view the elements of the eye's own slice are drawn last by the
    grid's order, far ones too, and their wide footprints shine through nearer walls
    beside them in streaks. Distance has no such plane, and does not change when the
    eye only turns. An orthographic list is returned as it is: there the grid's order
    has no fault.
    """
    if camera.projection is Projection.ORTHOGRAPHIC or len(shown) == 0:
        return shown
    matrix = rows.world_from_voxel
    k, j = np.divmod(shown.row, rows.shape[1])
    start = (matrix[:3, 3] - camera.eye_mm).astype(np.float32)
    axes = matrix[:3, :3].astype(np.float32)
    offset = start + np.multiply.outer(
        rows.x[shown.index].astype(np.float32), axes[:, 0]
    )
    offset += np.multiply.outer(j.astype(np.float32), axes[:, 1])
    offset += np.multiply.outer(k.astype(np.float32), axes[:, 2])
    distance = np.sqrt(np.einsum("ij,ij->i", offset, offset))
    # sixteen bits sort in linear time; a step is 2 microns at 130 mm
    key = (distance * (65535 / max(float(distance.max()), 1e-9))).astype(np.uint16)
    order = np.argsort(np.uint16(65535) - key, kind="stable")
    return DisplayList(shown.index[order], shown.row[order], shown.rows_kept)
