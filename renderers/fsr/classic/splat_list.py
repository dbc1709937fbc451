"""What one view needs of a set: the first of two stages.

Whole rows are clipped against the view. What is left of them is cut into shells of
distance: when one is drawn it is known which tiles need nothing of the next, and its
splats there need not even be listed.
"""

import math
from bisect import bisect_left
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernel_set import KernelSet
from renderers.fsr.classic.mode import SplatMode, Traversal
from renderers.fsr.classic.near import WIDEST_SIGMA, NearSplats, split_near
from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.classic.painted_set import PaintedSet
from renderers.fsr.classic.survey.kernels import BINS
from renderers.fsr.classic.view import View, view_of
from renderers.fsr.display_list import eye_voxel, view_planes
from renderers.fsr.footprint import (
    CUT_SIGMAS,
    SHEET_SIGMA_PER_SPACING,
    SIGMA_PER_SPACING,
)
from renderers.fsr.sparse_rows import SparseRows
from renderers.scene import Camera

SHARES = (1 / 16, 1 / 6, 1 / 2)
"""Of the elements, after which to look which tiles are finished."""

MANY = 1 << 17
"""Elements from which on it pays to look twice as often, see `_shares_for`."""

ACROSS = 0.25
"""Cosine between rows and the view's axis below which a row meets few shells."""

ROUNDED_MM = 1e-3
"""More than single precision moves a plane."""

_SPARE = 16
"""Spans behind the last, which vectors may write to."""

LEAST_SHELL = 1 << 13
"""Fewer elements take less time than looking at the tiles."""


@dataclass(frozen=True, slots=True)
class SplatList:
    """Hold what the view leaves of a set.

    spans: ``(k, 3)`` int32, see `ClippedRows`. lowest, highest: ``(k,)`` int32, the
    keys that bound each. begins: elements in the spans before each, and in all. near,
    near_mm: splats nearer than that, to be drawn first; they are in the spans, too.
    ends: last + 1 key of each shell. sheets: lowest depth, keys per mm and keys per
    sheet, as kernels take them; empty where splats are blended one by one.
    """

    camera: Camera
    mode: SplatMode
    traversal: Traversal
    view: View
    spans: NDArray[np.int32]
    lowest: NDArray[np.int32]
    highest: NDArray[np.int32]
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
    kernels: KernelSet,
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
    view = view_of(camera, painted.grid)
    sigma_mm = sigma_of(mode) * painted.widest_mm
    # the parts of a splat that is split may lie behind the next that is not
    near_mm = -math.inf if view.is_flat else sigma_mm / WIDEST_SIGMA + painted.widest_mm
    spans, ends, begins = _clip(painted, kernels, camera, view)
    lowest, highest = np.empty((2, len(spans) + _SPARE), np.int32)
    bins = np.empty(BINS, np.int64)
    near = np.empty(begins[-1] if near_mm > view.low else 0, np.int32)
    nears = kernels.survey_spans(
        spans,
        ends,
        painted.columns,
        view.base,
        view.matrix,
        view.is_flat,
        np.float32(view.low),
        np.float32(view.keys_per_mm),
        np.float32(near_mm if near_mm > view.low else -math.inf),
        lowest,
        highest,
        bins,
        near,
    )
    if traversal is Traversal.GRID:
        turns = _far_to_near(spans, painted.rows, camera)
        spans = spans[turns]
        lowest[: len(turns)] = lowest[turns]
        highest[: len(turns)] = highest[turns]
        np.cumsum(spans[:, 2] - spans[:, 1], out=begins[1:])
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
        lowest,
        highest,
        begins,
        split_near(near[:nears], painted.places, painted.paints, view, sigma_mm),
        near_mm,
        _shell_ends(bins, sheets, _shares_for(view, int(begins[-1]))),
        sheets,
    )


def _clip(
    painted: PaintedSet, kernels: KernelSet, camera: Camera, view: View
) -> tuple[NDArray[np.int32], NDArray[np.float32], NDArray[np.int64]]:
    """Clip all rows; give spans, ends and begins, see `clip_set`."""
    margin_mm = CUT_SIGMAS * SHEET_SIGMA_PER_SPACING * painted.widest_mm
    planes = view_planes(camera, margin_mm) @ painted.rows.world_from_voxel
    planes[:, 3] += planes[:, :3] @ view.base + ROUNDED_MM
    count = len(painted.row_numbers)
    spans = np.empty((count, 3), np.int32)
    ends = np.empty((4, count + _SPARE), np.float32)
    begins = np.empty(count + 1, np.int64)
    kept = kernels.clip_set(
        painted.row_numbers,
        painted.row_extents,
        painted.row_places,
        painted.columns,
        view.base,
        planes.astype(np.float32),
        spans,
        ends,
        begins,
    )
    return spans[:kept], ends, begins[: kept + 1]


def _far_to_near(
    spans: NDArray[np.int32], rows: SparseRows, camera: Camera
) -> NDArray[np.int64]:
    """Order slices, and rows in a slice, from both ends to the eye's own."""
    _, j, k = eye_voxel(rows, camera)
    slices, places = np.divmod(spans[:, 0], rows.shape[1])
    turns = _turn(places, j, rows.shape[1]), _turn(slices, k, rows.shape[0])
    return np.lexsort(turns)


def _turn(index: NDArray[np.int32], eye: int, count: int) -> NDArray[np.int64]:
    """Give the step at which each of 0..count - 1 is taken, from far to near."""
    return np.where(index < eye, index, eye + count - 1 - index)


def _shares_for(view: View, count: int) -> tuple[float, ...]:
    """Give `SHARES`, with one between each two for many elements in rows across.

    A shell looks at all elements of a row that it meets. Rows across the view of an eye
    outside meet few, so that more shells cost little, and what lies behind is found to
    be hidden sooner.
    """
    row, axis = view.matrix[:, 0], view.matrix[2, 0]
    if count < MANY or view.low == 0 or abs(axis) > ACROSS * np.linalg.norm(row):
        return SHARES
    between = [math.sqrt(a * b) for a, b in pairwise((*SHARES, 1.0))]
    return tuple(sorted((*SHARES, *between)))


def _shell_ends(
    bins: NDArray[np.int64], sheets: NDArray[np.float32], shares: tuple[float, ...]
) -> tuple[int, ...]:
    """Give keys at which shells end: between two sheets."""
    passed = np.cumsum(bins).tolist()
    every = passed[-1]
    ends: list[int] = []
    done = 0
    for share in shares:
        until = bisect_left(passed, share * every) + 1
        key = until * (KEYS // BINS)
        if len(sheets) and key < KEYS:
            number = np.floor(np.arange(KEYS, dtype=np.float32) / sheets[2])
            key = int(np.searchsorted(number, number[key]))
        inside = passed[min(until, BINS) - 1]
        if inside - done >= LEAST_SHELL and every - inside >= LEAST_SHELL:
            ends.append(key)
            done = inside
    return (*ends, KEYS)
