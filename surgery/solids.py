"""Rounded solids that tools sweep: capsules and blades, as rows of numbers.

A row of `ROW` float64 describes one solid in the patient's frame, mm. Several rows are
their union. Every solid has an exact signed distance, negative inside, which is what a
cut is made of (see `surgery.kernels.solid_distance`).
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from system import UserError

ROW = 16
CAPSULE, BLADE = 0.0, 2.0

ROUGH, SEED = 14, 15
"""Columns of the roughness's amplitude, mm, and of what its noise is drawn from."""

LONGEST_MM = 500.0
"""No tool is longer, nor does one move farther between two samples."""

Rows = NDArray[np.float64]


def capsule(
    from_mm: ArrayLike,
    to_mm: ArrayLike,
    radius_mm: float,
    *,
    rough_mm: float = 0.0,
    seed: int = 0,
) -> Rows:
    """Return a ball swept from one place to another, ``(1, 16)``.

    rough_mm: amplitude of the noise on its surface. seed: of that noise, which is fixed
    to the world: parts of a sweep together are the same solid as the whole.
    """
    row = np.zeros((1, ROW))
    row[0, 0] = CAPSULE
    row[0, 1:4], row[0, 4:7], row[0, 7] = from_mm, to_mm, radius_mm
    return checked(_roughened(row, rough_mm, seed))


def blade(
    before_mm: ArrayLike,
    after_mm: ArrayLike,
    radius_mm: float,
    *,
    rough_mm: float = 0.0,
    seed: int = 0,
) -> Rows:
    """Return what an edge sweeps between two places, ``(1, 16)``.

    before_mm, after_mm: ``(2, 3)`` the ends of the edge. radius_mm: half its thickness.
    The four points span two triangles.
    """
    row = np.zeros((1, ROW))
    row[0, 0] = BLADE
    row[0, 1:7] = np.asarray(before_mm, np.float64).ravel()
    row[0, 7:13] = np.asarray(after_mm, np.float64).ravel()
    row[0, 13] = radius_mm
    return checked(_roughened(row, rough_mm, seed))


def checked(rows: Rows) -> Rows:
    """Return the rows; UserError for one that is no solid of a tool's size."""
    if rows.ndim != 2 or rows.shape[1] != ROW:
        raise UserError(f"solids are rows of {ROW} numbers, got shape {rows.shape}")
    for row in rows:
        if not np.isfinite(row).all():
            raise UserError(f"a solid must be finite, got {row.tolist()}")
        if row[0] not in (CAPSULE, BLADE):
            raise UserError(f"a solid is of kind 0 or 2, got {row[0]:g}")
        size = row[7] if row[0] == CAPSULE else row[13]
        if not 0.0 < size <= LONGEST_MM:
            raise UserError(f"a solid needs a positive radius, got {size} mm")
        # no box is larger than twice this, and by far most are near the origin
        reach = np.abs(row[1:ROUGH]).max() + size + row[ROUGH]
        if not reach <= LONGEST_MM:
            low, high = bounds(row[None])
            if np.max(high - low) > 2 * LONGEST_MM:
                raise UserError(
                    f"a tool cannot sweep {np.max(high - low):.0f} mm between two "
                    "samples"
                )
        if not 0.0 <= row[ROUGH] <= 1.0:
            raise UserError(f"roughness lies within 0..1 mm, got {row[ROUGH]}")
    return rows


def bounds(rows: Rows) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners ``(3,)`` of a box that holds all solids, roughness included.

    mm, patient frame.
    """
    low, high = np.full(3, math.inf), np.full(3, -math.inf)
    for row in rows:
        if row[0] == CAPSULE:
            points, extent = row[1:7].reshape(2, 3), row[7]
        else:
            points, extent = row[1:13].reshape(4, 3), row[13]
        low = np.minimum(low, points.min(axis=0) - extent - row[ROUGH])
        high = np.maximum(high, points.max(axis=0) + extent + row[ROUGH])
    return low, high


def _roughened(row: Rows, rough_mm: float, seed: int) -> Rows:
    row[0, ROUGH], row[0, SEED] = rough_mm, seed
    return row


def in_capsules(rows: Rows, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which of points ``(n, 3)`` lie in any of some capsules."""
    starts, ways = rows[:, 1:4], rows[:, 4:7] - rows[:, 1:4]
    off = points[:, None] - starts
    squares = np.maximum((ways * ways).sum(axis=1), 1e-12)
    share = np.clip((off * ways).sum(axis=2) / squares, 0.0, 1.0)
    gaps = np.linalg.norm(off - share[..., None] * ways, axis=2) - rows[:, 7]
    inside: NDArray[np.bool_] = gaps.min(axis=1) < 0.0
    return inside
