"""The splats of a list as its camera sees them, piece by piece."""

import math

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernel_set import KernelSet
from renderers.fsr.classic.mode import SplatMode
from renderers.fsr.classic.near import LAST_SIGMA
from renderers.fsr.classic.ordered_splats import SPARE, Piece
from renderers.fsr.classic.projection.kernels import CUT, RECORD
from renderers.fsr.classic.splat_list import SplatList, sigma_of
from renderers.fsr.footprint import peak_table
from renderers.fsr.thread_team import ThreadTeam

PART = 1 << 13
"""Splats that one thread projects at a time."""

_STRIDE = PART + SPARE

PEAK_ROWS = 1024
_EDGE = math.exp(-0.5 * CUT**2)
FOOTPRINT_SUM = 2 * math.pi * (1 - _EDGE * (1 + 0.5 * CUT**2)) / (1 - _EDGE)
"""Integral of the edge-subtracted footprint, in squared sigmas."""


class ProjectedSplats:
    """Project pieces of lists into memory that is kept from piece to piece.

    records: ``(n, RECORD)`` float32, boxes: the same memory, ranges: ``(n,)`` int32
    tiles, see the kernels. parts: ``(p, 2)`` int64, which of these belong to the last
    piece. visible: how many of the last piece may show.
    """

    def __init__(self, kernels: KernelSet) -> None:
        self._project = kernels.project_splats
        self._make_room(1)
        self.parts: NDArray[np.int64] = np.empty((0, 2), np.int64)
        self.visible = 0

    def update(self, piece: Piece, splats: SplatList, team: ThreadTeam) -> None:
        """Project a piece of a list."""
        camera, view, mode = splats.camera, splats.view, splats.mode
        sigma = sigma_of(mode)
        parts = -(-piece.count // PART)
        if parts * _STRIDE > len(self.records):
            self._make_room(parts)

        def project(part: int) -> int:
            begin = part * _STRIDE
            return self._project(
                piece.index[part * PART :],
                min(piece.count - part * PART, PART),
                piece.places,
                piece.paints,
                view.base,
                view.matrix,
                np.float32(sigma),
                int(camera.projection),
                np.float32(view.scale),
                camera.width,
                camera.height,
                np.float32(LAST_SIGMA**2),
                peak_table(PEAK_ROWS),
                mode is SplatMode.POINTS,
                np.float32(FOOTPRINT_SUM if mode is SplatMode.SHEET else 0.0),
                self.records[begin : begin + _STRIDE],
                self.boxes[begin : begin + _STRIDE],
                self.ranges[begin : begin + _STRIDE],
            )

        done = team.map(project, range(parts))
        first = np.arange(parts)
        ends = np.minimum(PART, piece.count - first * PART)
        self.parts = np.stack([first * _STRIDE, first * _STRIDE + ends], axis=-1)
        self.visible = sum(done)

    def _make_room(self, parts: int) -> None:
        room = parts * _STRIDE
        self.records: NDArray[np.float32] = np.empty((room, RECORD), np.float32)
        self.boxes: NDArray[np.int32] = self.records.view(np.int32)
        self.ranges: NDArray[np.int32] = np.empty(room, np.int32)
