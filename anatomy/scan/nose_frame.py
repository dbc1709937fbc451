"""The nose's own frame: its middle, its floor and the choana, found in a scan.

Where the septum stands, a line across the head meets air, tissue and air again. Those
places make the nasal cavity's outline as it is seen from the side: its lower edge is
the nasal floor, its rear edge, low down, the choana.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.scan.airways import Airways
from anatomy.scan.midplane import SURE, Midplane
from anatomy.scan.scan import corners_of, inside
from renderers.scene.volume import Volume

STEP_MM = 1.0

REACH_MM, SEPTUM_MM = 14.0, 7.0
"""Half widths about the midplane: of the nasal passages, and within which a septum
bends."""

LEAST_MM2 = 500.0
"""Of the outline; a nasal cavity's side view covers 1200 to 2000 mm2."""

FLOOR_SHARE = (0.35, 0.9)
"""Part of the outline's length, from the front, whose lower edge is the hard palate's.
In front of it the vestibule descends to the nostrils."""

JUMP_MM = 4.0
"""Between neighbouring places of one floor it rises or falls by less."""

CHOANA_MM = (3.0, 14.0)
"""Heights above the floor at which the septum's rear edge is looked for."""

STEEPEST = 0.5
"""Slope of a floor in the scan; a steeper one is none."""

SETTLES = 0.5
"""Of the first turn: a second look that turns the floor by more has found another."""

SEEN_SHARE = 0.7
"""Of the floor that must have tissue below it, and not the end of the scan."""

BORDER_MM = 3.0
"""An edge so near to the end of what was scanned may have been cut."""


@dataclass(frozen=True, slots=True)
class NoseFrame:
    """A nose's axes: left, back and up, and its origin on the floor at the choana.

    axes: ``(3, 3)``, one unit vector a row, LPS. origin_mm: ``(3,)`` LPS.
    """

    axes: NDArray[np.float64]
    origin_mm: NDArray[np.float64]

    def places(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far points ``(..., 3)`` lie to the left, back and up, in mm."""
        result: NDArray[np.float64] = (points_mm - self.origin_mm) @ self.axes.T
        return result


def find_nose_frame(
    airways: Airways, distance: Volume, midplane: Midplane
) -> NoseFrame | None:
    """Find the frame; None where the halves are not alike, or septum or floor not seen.

    distance: signed mm to the air surface, negative in air, on the airways' grid.
    """
    if midplane.agreement < SURE:
        return None
    left = midplane.normal
    back = np.array([0.0, 1.0, 0.0]) - left[1] * left
    first = _frame_along(back, airways, distance, midplane)
    if first is None:
        return None
    # of a tilted outline another part is the hard palate's: look along its own floor
    second = _frame_along(first.axes[1], airways, distance, midplane)
    if second is None:
        return first
    turned = abs(float(second.axes[1] @ first.axes[2]))
    settles = turned < SETTLES * abs(float(first.axes[1] @ np.cross(left, back)))
    return second if settles else first


def _frame_along(
    back: NDArray[np.float64], airways: Airways, distance: Volume, midplane: Midplane
) -> NoseFrame | None:
    """Find the frame from a direction ``(3,)`` towards the back that is near it."""
    left, middle_mm = midplane.normal, midplane.offset_mm
    back = back / np.linalg.norm(back)
    axes = np.stack([left, back, np.cross(left, back)])
    corners = corners_of(distance) @ axes.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    v = np.arange(low[1], high[1], STEP_MM)
    w = np.arange(low[2], high[2], STEP_MM)
    outline = _outline(airways, distance, axes, middle_mm, (v, w))
    if np.count_nonzero(outline) * STEP_MM**2 < LEAST_MM2:
        return None
    columns = _longest_run(outline)
    first, last = columns[0], columns[-1]
    share = (columns - first) / max(last - first, 1)
    columns = columns[(share >= FLOOR_SHARE[0]) & (share <= FLOOR_SHARE[1])]
    lowest = w[outline[columns].argmax(axis=1)]
    slope, height = _line(v[columns], lowest)
    under = np.stack(
        [np.full(len(columns), middle_mm), v[columns], lowest - BORDER_MM], 1
    )
    is_seen = _is_scanned(airways, under @ axes)
    if np.mean(is_seen) < SEEN_SHARE or abs(slope) > STEEPEST:
        return None
    above = w[None, :] - (height + slope * v[:, None])
    near = (above >= CHOANA_MM[0]) & (above <= CHOANA_MM[1])
    rows = np.flatnonzero((outline & near).any(axis=0))
    if not len(rows):
        return None
    rear = [v[np.flatnonzero(outline[:, row] & near[:, row])[-1]] for row in rows]
    choana = float(np.median(rear)) + STEP_MM / 2
    origin = np.array([middle_mm, choana, height + slope * choana]) @ axes
    turn = np.arctan(slope)
    tilted = np.cos(turn) * axes[1] + np.sin(turn) * axes[2]
    turned = np.stack([axes[0], tilted, np.cross(axes[0], tilted)])
    return NoseFrame(turned, origin)


def _longest_run(outline: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the columns of the longest lower edge without a jump.

    Behind the choana a septum stands in the sphenoid too, whose floor is a step higher.
    """
    columns = np.flatnonzero(outline.any(axis=1))
    lowest = outline[columns].argmax(axis=1) * STEP_MM
    jumps = np.flatnonzero(np.abs(np.diff(lowest)) > JUMP_MM) + 1
    return max(np.split(columns, jumps), key=len)


def _outline(
    airways: Airways,
    distance: Volume,
    axes: NDArray[np.float64],
    middle_mm: float,
    grid: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> NDArray[np.bool_]:
    """Mark where a septum stands between air and air, ``(back, up)``; one piece."""
    u = middle_mm + np.arange(-REACH_MM, REACH_MM + STEP_MM / 2, STEP_MM)
    points = np.stack(np.meshgrid(u, *grid, indexing="ij"), axis=-1) @ axes
    inner = airways.outside_mm.sample(points.reshape(-1, 3)) > 0
    air = (distance.sample(points.reshape(-1, 3)) < 0) & inner
    air = air.reshape(points.shape[:3])
    before = np.maximum.accumulate(air, axis=0)
    behind = np.maximum.accumulate(air[::-1], axis=0)[::-1]
    central = np.abs(u - middle_mm) <= SEPTUM_MM
    between = np.any((~air & before & behind)[central], axis=0)
    opened: NDArray[np.bool_] = ndimage.binary_opening(between, iterations=2)
    parts, count = ndimage.label(opened)
    if not count:
        return opened
    largest = np.bincount(parts.ravel())[1:].argmax() + 1
    result: NDArray[np.bool_] = np.asarray(parts) == largest
    return result


def _is_scanned(airways: Airways, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which points lie in the head and not beyond what was scanned."""
    grid = airways.outside_mm
    result: NDArray[np.bool_] = inside(grid, points, 0.0) & (grid.sample(points) > 0)
    return result


def _line(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float]:
    """Fit a line by medians of slopes (Theil 1950, Sen 1968): slope and height at 0."""
    i, j = np.triu_indices(len(x), max(len(x) // 4, 1))
    if not len(i):
        return 0.0, float(np.median(y))
    slope = float(np.median((y[j] - y[i]) / (x[j] - x[i])))
    return slope, float(np.median(y - slope * x))
