"""The splats of a set as one camera sees them."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.mode import SplatMode
from renderers.fsr.classic.near import LAST_SIGMA, SPLITS, WIDEST_SIGMA, split
from renderers.fsr.classic.painted_set import PaintedSet
from renderers.fsr.classic.projection.kernels import CUT, KEYS, NOWHERE, RECORD
from renderers.fsr.footprint import (
    SHEET_SIGMA_PER_SPACING,
    SIGMA_PER_SPACING,
    peak_table,
)
from renderers.fsr.scope.scratch import lined_up
from renderers.fsr.thread_team import ThreadTeam
from renderers.scene import Camera, Projection

PART = 1 << 14
"""Splats that one thread projects at a time."""

SPARE = 16
PEAK_ROWS = 1024
_EDGE = math.exp(-0.5 * CUT**2)
FOOTPRINT_SUM = 2 * math.pi * (1 - _EDGE * (1 + 0.5 * CUT**2)) / (1 - _EDGE)
"""Integral of the edge-subtracted footprint, in squared sigmas."""


@dataclass(frozen=True, slots=True)
class View:
    """Hold a camera in terms of a grid.

    base: the grid point next to the eye; places are counted from it, so that near
    splats keep their digits. matrix: ``(3, 4)``, camera frame from steps away from it.
    low, high: depths (mm) of the grid's nearest and farthest points.
    """

    base: NDArray[np.float64]
    matrix: NDArray[np.float64]
    low: float
    high: float

    @property
    def keys_per_mm(self) -> float:
        """Get the scale from depth to the keys of the order."""
        return KEYS / max(self.high - self.low, 1e-9)


def view_of(camera: Camera, painted: PaintedSet) -> View:
    """Find how a camera sees a set's grid."""
    world_from_voxel = painted.rows.world_from_voxel
    axes = camera.frame[1:] @ world_from_voxel[:3, :3]
    start = camera.frame[1:] @ (world_from_voxel[:3, 3] - camera.eye_mm)
    top = np.array(painted.rows.shape[::-1]) - 1.0
    base = np.clip(np.rint(np.linalg.solve(axes, -start)), 0, top)
    matrix = np.column_stack([axes, axes @ base + start])
    corners = np.array(np.meshgrid(*zip(-0.5 - np.zeros(3), top + 0.5, strict=True)))
    seen = axes @ corners.reshape(3, -1) + start[:, None]
    if camera.projection is Projection.ORTHOGRAPHIC:
        return View(base, matrix, float(seen[2].min()), float(seen[2].max()))
    middle, reach = seen.mean(axis=1), np.ptp(seen, axis=1)
    low = max(float(np.linalg.norm(middle) - np.linalg.norm(reach) / 2), 0.0)
    return View(base, matrix, low, float(np.linalg.norm(seen, axis=0).max()))


class ProjectedSplats:
    """Project a set, part by part, into memory that is kept from view to view.

    records: ``(n, RECORD)`` float32, heads: ``(n, 4)`` int32, see the kernel. count:
    of them, some of which are in no tile. visible: that are.
    """

    def __init__(
        self, painted: PaintedSet, project: Callable[..., tuple[int, int]]
    ) -> None:
        self._painted = painted
        self._project = project
        self.records: NDArray[np.float32] = np.empty((0, RECORD), np.float32)
        self.boxes: NDArray[np.int32] = self.records.view(np.int32)
        self.heads: NDArray[np.int32] = np.empty((0, 4), np.int32)
        self._near: NDArray[np.int32] = np.empty(0, np.int32)
        self.count = self.visible = self.split = 0

    def update(
        self,
        index: NDArray[np.int32],
        n: int,
        camera: Camera,
        mode: SplatMode,
        team: ThreadTeam,
    ) -> View:
        """Project the first n splats named by index, which has sixteen to spare.

        Splats nearer than ten sigmas are split.
        """
        painted = self._painted
        view = view_of(camera, painted)
        self.count = self.visible = self.split = 0
        near = self._add(
            index, n, painted.places, painted.paints, view, 1.0, camera, mode, team
        )
        places, paints = painted.places, painted.paints
        size = 1.0
        for _ in range(SPLITS):
            if len(near) == 0:
                break
            self.split += len(near)
            places = split(places[near], size)
            paints = np.repeat(paints[near], 8, axis=0)
            size /= 2
            parts = np.zeros(len(places) + SPARE, np.int32)
            parts[: len(places)] = np.arange(len(places))
            near = self._add(
                parts, len(places), places, paints, view, size, camera, mode, team
            )
        return view

    def _add(
        self,
        index: NDArray[np.int32],
        n: int,
        places: NDArray[np.float32],
        paints: NDArray[np.float32],
        view: View,
        size: float,
        camera: Camera,
        mode: SplatMode,
        team: ThreadTeam,
    ) -> NDArray[np.int32]:
        """Project splats of `size` grid steps; give those too near to be drawn."""
        parts = -(-n // PART)
        stride = PART + SPARE if parts > 1 else n + SPARE
        first = self.count
        self.count += parts * stride
        self._make_room(parts * stride)
        last = size == 0.5**SPLITS
        widest = LAST_SIGMA if last else WIDEST_SIGMA
        scaled = places
        if size != 1.0:
            scaled = places.copy()
            scaled[:, :3] /= np.float32(size)
        matrix = view.matrix.copy()
        matrix[:, :3] *= size
        half = 0.5 * min(camera.width, camera.height)
        pinhole = camera.projection is Projection.PERSPECTIVE
        scale = half / (math.tan(camera.extent) if pinhole else camera.extent)
        sheets, sigma = 0.0, SIGMA_PER_SPACING
        if mode is SplatMode.SHEET:
            sheets, sigma = FOOTPRINT_SUM, SHEET_SIGMA_PER_SPACING

        def project(part: int) -> tuple[int, int]:
            begin = first + part * stride
            listed = min(n - part * PART, PART)
            heads = self.heads[begin : begin + stride]
            visible, near = self._project(
                index[part * PART :],
                listed,
                scaled,
                paints,
                (view.base / size).astype(np.float32),
                matrix.astype(np.float32),
                np.float32(sigma),
                int(camera.projection),
                np.float32(scale),
                camera.width,
                camera.height,
                np.float32(widest**2),
                peak_table(PEAK_ROWS),
                mode is SplatMode.POINTS,
                np.float32(sheets),
                np.float32(view.low),
                np.float32(view.keys_per_mm),
                self.records[begin : begin + stride],
                self.boxes[begin : begin + stride],
                heads,
                self._near[part * stride :],
            )
            heads[listed:] = NOWHERE, KEYS - 1, 0, 0
            return visible, near

        done = team.map(project, range(parts))
        self.visible += sum(visible for visible, _ in done)
        if last or not any(near for _, near in done):
            return np.empty(0, np.int32)
        return np.concatenate(
            [
                self._near[part * stride : part * stride + near]
                for part, (_, near) in enumerate(done)
            ]
        )

    def _make_room(self, added: int) -> None:
        if len(self._near) < added:
            self._near = np.empty(added, np.int32)
        if len(self.records) < self.count:
            room = self.count * 5 // 4
            records = lined_up(room * RECORD).reshape(room, RECORD)
            records[: len(self.records)] = self.records
            heads = np.empty((room, 4), np.int32)
            heads[: len(self.heads)] = self.heads
            self.records, self.heads = records, heads
            self.boxes = records.view(np.int32)
