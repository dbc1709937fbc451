"""The splats of a list as its camera sees them, piece by piece."""

import math

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernel_set import KernelSet
from renderers.fsr.classic.mode import SplatMode
from renderers.fsr.classic.near import LAST_SIGMA
from renderers.fsr.classic.ordering.kernels import (
    KEYS,
    begin_keys,
)
from renderers.fsr.classic.pieces.kernels import order_piece
from renderers.fsr.classic.projection.kernels import CUT, RECORD
from renderers.fsr.classic.splat_list import SplatList, sigma_of
from renderers.fsr.classic.taken_splats import SPARE, Piece
from renderers.fsr.scope.scratch import lined_up
from renderers.scene.thread_team import ThreadTeam

LEAST_SHARED = 1 << 15
"""Fewer splats are put in order by one thread: two write into the same lines of the
cache."""

_EDGE = math.exp(-0.5 * CUT**2)
FOOTPRINT_SUM = 2 * math.pi * (1 - _EDGE * (1 + 0.5 * CUT**2)) / (1 - _EDGE)
"""Integral of the edge-subtracted footprint, in squared sigmas."""


class ProjectedSplats:
    """Project pieces of lists, in memory that is kept from piece to piece.

    records: ``(n, RECORD)`` float32, boxes: ``(n, 4)`` int32, see the kernels. Of the
    last piece, near ones first: entries: ``(n,)`` int64, records and tiles of those
    that may show, see `place_by_keys`. visible: how many these are.
    """

    def __init__(self, kernels: KernelSet) -> None:
        self._project = kernels.project_piece
        self._counts: NDArray[np.int32] = np.empty((0, KEYS), np.int32)
        self._make_room(1)
        self.visible = 0

    def project(self, piece: Piece, splats: SplatList, team: ThreadTeam) -> None:
        """Take a piece of a list and project it."""
        camera, view, mode = splats.camera, splats.view, splats.mode
        if len(piece.index) > len(self.records):
            self._make_room(len(piece.index))
        if piece.parts > len(self._counts):
            self._counts = np.empty((piece.parts, KEYS), np.int32)
        threads = min(team.threads, piece.parts)
        turns = np.zeros(threads, np.int64)
        seen_by = (
            view.base,
            view.matrix,
            int(camera.projection),
            np.float32(view.scale),
            camera.width,
            camera.height,
        )
        look = (
            np.float32(sigma_of(mode)),
            np.float32(LAST_SIGMA**2),
            piece.sized,
            mode is SplatMode.POINTS,
            np.float32(FOOTPRINT_SUM if mode is SplatMode.SHEET else 0.0),
        )

        def project(who: int) -> None:
            self._project(
                turns,
                who,
                piece.starts,
                piece.taken,
                piece.cuts,
                piece.index,
                piece.keys,
                piece.first_key,
                piece.end_key,
                piece.spans,
                seen_by,
                look,
                piece.places,
                piece.paints,
                self.records,
                self.boxes,
                self._found,
                self._counts,
            )

        team.map(project, range(threads))

    def order(self, piece: Piece, team: ThreadTeam) -> None:
        """Put the piece that was projected in order."""
        counts = self._counts[: piece.parts]
        self.visible = begin_keys(counts, piece.first_key, piece.end_key)
        helped = self.visible >= LEAST_SHARED and piece.parts > 1
        threads = team.threads if helped else 1
        turns = np.zeros(threads, np.int64)

        def place(who: int) -> None:
            order_piece(
                turns,
                who,
                piece.starts,
                piece.taken,
                self._found,
                piece.keys,
                counts,
                self.entries,
            )

        team.map(place, range(threads))

    def _make_room(self, room: int) -> None:
        self.records: NDArray[np.float32] = lined_up(room * RECORD)
        self.records = self.records.reshape(-1, RECORD)
        self.boxes: NDArray[np.int32] = lined_up(room * 4, np.int32).reshape(-1, 4)
        self._found: NDArray[np.int32] = np.empty(room, np.int32)
        self.entries: NDArray[np.int64] = np.zeros(room + SPARE, np.int64)
