"""What one view needs of a set: the first of two stages.

Whole rows are clipped against the view. What is left of them is cut into shells of
distance: when one is drawn it is known which tiles need nothing of the next, and its
splats there need not even be listed.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.mode import SplatMode, Traversal
from renderers.fsr.classic.near import WIDEST_SIGMA, NearSplats, split_near
from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.classic.painted_set import PaintedSet
from renderers.fsr.classic.shells.kernels import BINS, survey_spans
from renderers.fsr.classic.view import View, view_of
from renderers.fsr.display_list import clip_rows
from renderers.fsr.footprint import (
    CUT_SIGMAS,
    SHEET_SIGMA_PER_SPACING,
    SIGMA_PER_SPACING,
)
from renderers.scene import Camera

SHARES = (1 / 16, 1 / 6, 1 / 2)
"""Of the elements, after which to look which tiles are finished."""

LEAST_SHELL = 1 << 13
"""Fewer elements take less time than looking at the tiles."""


@dataclass(frozen=True, slots=True)
class SplatList:
    """Hold what the view leaves of a set.

    spans: ``(k, 3)`` int32, see `ClippedRows`. bounds: ``(k, 2)`` int32, the lowest
    and highest key of each. begins: elements in the spans before
    each, and in all. near, near_mm: splats nearer than that, to be drawn first; they
    are in the spans, too. ends: last + 1 key of each shell. sheets: lowest depth, keys
    per mm and keys per sheet, as kernels take them; empty where splats are blended one
    by one.
    """

    camera: Camera
    mode: SplatMode
    traversal: Traversal
    view: View
    spans: NDArray[np.int32]
    bounds: NDArray[np.int32]
    begins: NDArray[np.int64]
    near: NearSplats
    near_mm: float
    ends: tuple[int, ...]
    sheets: NDArray[np.float32]

    @property
    def count(self) -> int:
        """Get the number of elements in the spans."""
        return int(self.begins[-1])


def sigma_of(mode: SplatMode) -> float:
    """Give a mode's sigma of a footprint, in grid steps."""
    sheet = mode is SplatMode.SHEET
    return SHEET_SIGMA_PER_SPACING if sheet else SIGMA_PER_SPACING


def list_splats(
    painted: PaintedSet,
    camera: Camera,
    mode: SplatMode,
    traversal: Traversal = Traversal.DISTANCE,
) -> SplatList:
    """Cull a set for one view and cut it into shells.

    Raises ValueError for sheets in another order than that of distance.
    """
    if mode is SplatMode.SHEET and traversal is not Traversal.DISTANCE:
        raise ValueError(
            f"sheets are layers of distance, so their splats need the order "
            f"{Traversal.DISTANCE.value!r}, got {traversal.value!r}"
        )
    view = view_of(camera, painted.rows)
    margin_mm = CUT_SIGMAS * SHEET_SIGMA_PER_SPACING * painted.widest_mm
    spans = clip_rows(painted.rows, camera, margin_mm).spans
    sigma_mm = sigma_of(mode) * painted.widest_mm
    # the parts of a splat that is split may lie behind the next that is not
    near_mm = -math.inf if view.is_flat else sigma_mm / WIDEST_SIGMA + painted.widest_mm
    begins = np.zeros(len(spans) + 1, np.int64)
    np.cumsum(spans[:, 2] - spans[:, 1], out=begins[1:])
    bounds = np.empty((len(spans), 2), np.int32)
    bins = np.empty(BINS, np.int64)
    near = np.empty(begins[-1] if near_mm > view.low else 0, np.int32)
    nears = survey_spans(
        spans,
        painted.rows.shape[1],
        painted.columns,
        view.base,
        view.matrix,
        view.is_flat,
        np.float32(view.low),
        np.float32(view.keys_per_mm),
        np.float32(near_mm if near_mm > view.low else -math.inf),
        bounds,
        bins,
        near,
    )
    here = near[:nears]
    sheets = np.empty(0, np.float32)
    if mode is SplatMode.SHEET:
        keys_per_sheet = view.keys_per_mm * painted.sheet_mm
        sheets = np.array([view.low, view.keys_per_mm, keys_per_sheet], np.float32)
    return SplatList(
        camera,
        mode,
        traversal,
        view,
        spans,
        bounds,
        begins,
        split_near(painted.places[here], painted.paints[here], view, sigma_mm),
        near_mm,
        _shell_ends(bins, sheets),
        sheets,
    )


def _shell_ends(
    bins: NDArray[np.int64], sheets: NDArray[np.float32]
) -> tuple[int, ...]:
    """Give keys at which shells end: between two sheets."""
    passed = np.cumsum(bins)
    ends: list[int] = []
    done = 0
    for share in SHARES:
        until = int(np.searchsorted(passed, share * passed[-1])) + 1
        key = until * (KEYS // BINS)
        if len(sheets) and key < KEYS:
            number = np.floor(np.arange(KEYS, dtype=np.float32) / sheets[2])
            key = int(np.searchsorted(number, number[key]))
        inside = int(passed[min(until, BINS) - 1])
        if inside - done >= LEAST_SHELL and passed[-1] - inside >= LEAST_SHELL:
            ends.append(key)
            done = inside
    return (*ends, KEYS)
