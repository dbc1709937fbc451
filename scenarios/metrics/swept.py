"""What a scope swept: how much room, and how much of the mucosa it touched."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from scenarios.metrics.contact import UNMEASURED, in_contact
from scenarios.metrics.episodes import intervals
from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import SCOPE, Definition, Found, too_little
from scenarios.metrics.track import third_column

Doubles = NDArray[np.float64]

FINENESS = 4
"""Cells of the grid on which volume is counted, to a radius of the scope."""

REACH_MM = 110.0
"""Length of shaft that may touch: the whole nasal passage."""

ASKEW = Rotation.from_rotvec([0.4, 0.7, 1.1]).as_matrix()
"""Turns what is counted against the grid: a shaft along it would be miscounted."""

FARTHEST_MM = 250.0
"""What is farther from the middle of the way is in no head, and is left out."""

PATCH_HALF_MM = 0.5
"""Half of a patch of mucosa: so near to the scope's edge one may count or not."""

NO_MUCOSA = "the head has no mucosa that is known"


def swept_mm3(measured: Measured) -> Found:
    """Return the volume of all places that the end of the shaft was in, mm3.

    It is counted once, however often the scope came back. The end is a capsule of the
    scope's radius and of `Settings.swept_length_mm`.
    """
    radius = measured.endoscope.diameter_mm / 2
    length = max(measured.settings.swept_length_mm - 2 * radius, 0.0)
    step = radius / FINENESS
    parts = [
        _axis_points(piece.tip_mm + radius * piece.back, piece.back, length, step)
        for piece in measured.scope_pieces
    ]
    if not parts:
        return too_little("four samples without a gap are needed")
    points = np.concatenate(parts)
    # a device that lost its place must not ask for a grid without end
    off = np.abs(points - np.median(points, axis=0)).max(axis=1)
    points = points[off <= FARTHEST_MM]
    return Found(_union_mm3(points, radius, step), measured.spans(SCOPE))


def touched_mm2(measured: Measured) -> Found:
    """Return the area of the mucosa that the shaft touched, mm2, each part once.

    A patch is touched when the shaft's axis comes within the scope's radius of it. Its
    sigma is half the patches at the edge of what was touched.
    """
    contacts, mucosa = measured.contacts, measured.mucosa
    if contacts is None:
        return Found(None, (), UNMEASURED)
    if mucosa is None or not len(mucosa.area_mm2):
        return Found(None, (), NO_MUCOSA)
    state = in_contact(measured, contacts)
    spans = intervals(contacts.time_s, state, measured.settings.gap_s)
    track, radius = measured.scope, measured.endoscope.diameter_mm / 2
    known = track.valid
    at = np.clip(
        np.searchsorted(contacts.time_s, track.time_s[known]), 0, len(state) - 1
    )
    known = known[state[at]]
    if not len(known):
        return Found(0.0, spans)
    back = third_column(track.quaternion[known])
    begin = track.tip_mm[known] + radius * back
    points = _axis_points(begin, back, REACH_MM, 0.25)
    away, _ = cKDTree(points).query(
        mucosa.places, distance_upper_bound=radius + PATCH_HALF_MM
    )
    area = mucosa.area_mm2
    edge = np.abs(away - radius) < PATCH_HALF_MM
    sigma = 0.5 * math.sqrt(float((area[edge] ** 2).sum()))
    return Found(float(area[away <= radius].sum()), spans, sigma=sigma)


def _axis_points(
    begin: Doubles, along: Doubles, length: float, apart: float
) -> Doubles:
    """Return points of a shaft's axis, one of each small cube, at its exact place.

    begin, along: ``(n, 3)`` its end and unit direction. apart: between points, mm, at
    most; poses whose ends both moved less count once.
    """
    ends = np.concatenate([begin, begin + length * along], axis=1)
    chosen = _first_of_each(np.rint(ends / apart).astype(np.int64))
    share = np.linspace(0.0, length, max(math.ceil(length / apart), 1) + 1)
    points = begin[chosen, None] + share[None, :, None] * along[chosen, None]
    flat: Doubles = points.reshape(-1, 3)
    return flat[_first_of_each(np.rint(2.0 * flat / apart).astype(np.int64))]


def _first_of_each(rows: NDArray[np.int64]) -> NDArray[np.intp]:
    """Return the place of the first of all rows ``(n, k)`` that are alike."""
    # one number a row; two that differ have the same once in 2**64
    hashed = np.zeros(len(rows), np.uint64)
    for column in rows.T.astype(np.uint64):
        hashed = (hashed ^ column) * np.uint64(0x9E3779B97F4A7C15)
        hashed ^= hashed >> np.uint64(29)
    _, first = np.unique(hashed, return_index=True)
    return first


def _union_mm3(points: Doubles, radius: float, cell: float) -> float:
    """Return the volume within a radius of any point, by counting cells."""
    points = points @ ASKEW
    reach = math.ceil(radius / cell) + 1
    low = np.floor(points.min(axis=0) / cell).astype(np.int64) - reach
    cubes = np.floor(points / cell).astype(np.int64) - low
    shape = cubes.max(axis=0) + 2 * reach + 1
    near = np.zeros(shape, bool)
    near[tuple(cubes.T)] = True
    for axis in range(3):
        grown = near.copy()
        for by in range(1, reach + 1):
            ahead = [slice(None)] * 3
            behind = [slice(None)] * 3
            ahead[axis], behind[axis] = slice(by, None), slice(None, -by)
            grown[tuple(ahead)] |= near[tuple(behind)]
            grown[tuple(behind)] |= near[tuple(ahead)]
        near = grown
    middles = (np.argwhere(near) + low + 0.5) * cell
    away, _ = cKDTree(points).query(middles, distance_upper_bound=radius)
    return float(np.isfinite(away).sum()) * cell**3


SWEPT = (
    Definition(
        "volume swept",
        SCOPE,
        "mm3",
        swept_mm3,
        "low-passed",
        moves=True,
        is_slow=True,
    ),
    Definition("touched area", SCOPE, "mm2", touched_mm2, is_slow=True),
)
