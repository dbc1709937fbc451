"""A fuzzy set drawn the 1995 way: shaded splats composited far to near."""

import threading

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.culling.kernels import bin_boxes
from renderers.fsr.display_list import (
    DisplayList,
    build_display_list,
    sorted_by_distance,
)
from renderers.fsr.footprint import CUT_SIGMAS, SIGMA_PER_SPACING, peak_table
from renderers.fsr.fuzzy_set import FuzzySet
from renderers.fsr.kernels import RECORD, draw_band, project_splats
from renderers.fsr.thread_team import ThreadTeam
from renderers.scene import Camera, Image, Scene

BAND_SHIFT = 4
BAND_HEIGHT = 1 << BAND_SHIFT
"""Rows of a band: 512 pixels of it (128 kB) stay in the second-level cache."""

WHOLE_ROW_SHIFT = 30

TABLE_ROWS = 4096
PEAK_ROWS = 1024


class SplatRasterizer:
    """Draw pictures of mode `classic`; keeps its scratch memory between pictures.

    Ambient and diffuse light only: like the 1995 renderer, it varies no highlights
    from splat to splat.
    """

    def __init__(self, fuzzy_set: FuzzySet, scene: Scene) -> None:
        self._set = fuzzy_set
        self._rows = fuzzy_set.rows.row_count
        low, high = scene.volume.value_range
        high = max(high, low + 1.0)
        self._table = scene.transfer_function.table(low, high, TABLE_ROWS)
        self._table_low = low
        self._table_scale = (TABLE_ROWS - 1) / (high - low)
        self._lights = np.array(
            [[*li.vector, *li.color, float(li.is_local)] for li in scene.lights],
            dtype=np.float64,
        ).reshape(-1, 7)
        self._material = scene.material
        self._volume_mm3 = float(np.prod(scene.volume.spacing_mm))
        self._margin = CUT_SIGMAS * SIGMA_PER_SPACING * scene.volume.spacing_mm.max()
        self._records = np.empty((0, RECORD), np.float32)
        self._boxes = np.empty((0, 4), np.int32)
        self._items = np.empty(0, np.int32)
        self._local = threading.local()
        self.counters: dict[str, int] = {}

    def draw(self, camera: Camera, team: ThreadTeam, *, points: bool = False) -> Image:
        """Composite one view; the bits do not depend on the team's size.

        points: squares of constant opacity, faster and with visible artefacts.
        """
        rows = self._set.rows
        shown = build_display_list(rows, camera, float(self._margin))
        shown = sorted_by_distance(shown, rows, camera)
        visible = self._project(camera, shown, points)
        bands = -(-camera.height // BAND_HEIGHT)
        start = self._bin(visible, bands)
        rgba = np.zeros((camera.height, camera.width * 4), np.float32)

        def draw(band: int) -> int:
            fragments: int = draw_band(
                self._records,
                self._boxes,
                self._items[start[band] : start[band + 1]],
                points,
                band * BAND_HEIGHT,
                min((band + 1) * BAND_HEIGHT, camera.height),
                self._scratch(camera.width),
                rgba,
            )
            return fragments

        fragments = sum(team.map(draw, range(bands)))
        self.counters = {
            "listed": len(shown),
            "visible": visible,
            "rows": self._rows,
            "culled rows": self._rows - shown.rows_kept,
            "fragments": fragments,
        }
        return Image(rgba.reshape(camera.height, camera.width, 4))

    def _project(self, camera: Camera, shown: DisplayList, points: bool) -> int:
        if len(self._records) < len(shown):
            self._records = np.empty((len(shown), RECORD), np.float32)
            self._boxes = np.empty((len(shown), 4), np.int32)
        rows = self._set.rows
        matrix = rows.world_from_voxel
        axes = camera.frame[1:]
        camera_from_voxel = np.empty((3, 4))
        camera_from_voxel[:, :3] = axes @ matrix[:3, :3]
        camera_from_voxel[:, 3] = axes @ (matrix[:3, 3] - camera.eye_mm)
        visible: int = project_splats(
            shown.index,
            shown.row,
            rows.x,
            self._set.octahedral,
            self._set.value,
            rows.shape[1],
            camera_from_voxel,
            camera.frame,
            self._volume_mm3,
            SIGMA_PER_SPACING,
            int(camera.projection),
            camera.extent,
            camera.width,
            camera.height,
            self._table,
            self._table_low,
            self._table_scale,
            peak_table(PEAK_ROWS),
            self._lights,
            self._material.ambient,
            self._material.diffuse,
            points,
            self._records,
            self._boxes,
        )
        return visible

    def _bin(self, visible: int, bands: int) -> NDArray[np.int64]:
        start = np.zeros(bands + 2, np.int64)
        while True:
            entries = bin_boxes(
                self._boxes,
                visible,
                1,
                bands,
                WHOLE_ROW_SHIFT,
                BAND_SHIFT,
                start,
                self._items,
            )
            if entries <= len(self._items):
                return start
            self._items = np.empty(entries * 3 // 2, np.int32)

    def _scratch(self, width: int) -> NDArray[np.float32]:
        weights: NDArray[np.float32] | None = getattr(self._local, "weights", None)
        if weights is None or len(weights) < width:
            weights = np.empty(width, np.float32)
            self._local.weights = weights
        return weights
