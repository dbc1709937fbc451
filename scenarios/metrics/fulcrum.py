"""The nostril as a pivot: where the scope's axes meet, and how far they miss it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import SCOPE, Definition, Found, too_little
from scenarios.metrics.track import third_column

Doubles = NDArray[np.float64]

_LEAST_AXES = 3
_WINDOWS = 4
"""The drift is told between this many equal parts of the samples."""


class Pivot(NamedTuple):
    """The point nearest to all axes.

    at_mm: ``(3,)``; residual_mm: rms distance of the axes from it; condition: of the
    equations. The residual cannot tell that a pivot is weak, the condition does.
    """

    at_mm: Doubles
    residual_mm: float
    condition: float


def pivot_of(tip_mm: Doubles, axis: Doubles) -> Pivot | None:
    """Find argmin sum |(I - d d^T)(p - x)|^2 over axes ``(n, 3)`` through tips.

    None for fewer than three axes, or where all are parallel.
    """
    if len(tip_mm) < _LEAST_AXES:
        return None
    # about the mean: far from the origin the products would lose digits
    centre = tip_mm.mean(axis=0)
    near = tip_mm - centre
    matrix = len(axis) * np.eye(3) - axis.T @ axis
    values = np.linalg.eigvalsh(matrix)
    if not values[0] > 1e-12 * values[-1]:
        return None
    along = np.einsum("ij,ij->i", near, axis)
    at = np.linalg.solve(matrix, near.sum(axis=0) - along @ axis)
    towards = at - near
    missed = towards - np.einsum("ij,ij->i", towards, axis)[:, None] * axis
    residual = float(np.sqrt((missed**2).sum(axis=1).mean()))
    return Pivot(at + centre, residual, float(values[-1] / values[0]))


def _axes(measured: Measured) -> tuple[Doubles, Doubles, Doubles]:
    track = measured.scope
    places = track.valid
    return (
        track.time_s[places],
        track.tip_mm[places],
        third_column(track.quaternion[places]),
    )


def _pivot(measured: Measured) -> tuple[Pivot | None, str]:
    _, tip, axis = _axes(measured)
    found = pivot_of(tip, axis)
    if found is None:
        return None, f"not enough data: {_LEAST_AXES} axes that are not parallel"
    most = measured.settings.largest_condition
    if found.condition > most:
        return None, (
            f"not enough data: the axes are nearly parallel (condition "
            f"{found.condition:.0f}, at most {most:g})"
        )
    return found, ""


def pivot_residual_mm(measured: Measured) -> Found:
    """Return the rms distance of the scope's axes from their pivot."""
    found, reason = _pivot(measured)
    if found is None:
        return Found(None, (), reason)
    return Found(found.residual_mm, measured.spans(SCOPE))


def pivot_condition(measured: Measured) -> Found:
    """Return the condition of the pivot's equations."""
    _, tip, axis = _axes(measured)
    found = pivot_of(tip, axis)
    if found is None:
        return too_little(f"{_LEAST_AXES} axes that are not parallel are needed")
    return Found(found.condition, measured.spans(SCOPE))


def pivot_drift_mm(measured: Measured) -> Found:
    """Return how far the pivots of four parts of the session lie apart at most."""
    whole, reason = _pivot(measured)
    if whole is None:
        return Found(None, (), reason)
    _, tip, axis = _axes(measured)
    places: list[Doubles] = []
    for part in np.array_split(np.arange(len(tip)), _WINDOWS):
        found = pivot_of(tip[part], axis[part])
        if found is not None and found.condition <= measured.settings.largest_condition:
            places.append(found.at_mm)
    if len(places) < 2:
        return too_little("two parts of the session must have a pivot")
    points = np.array(places)
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    return Found(float(apart.max()), measured.spans(SCOPE))


def nostril_excursion_mm(measured: Measured) -> Found:
    """Return how far the shaft was from the pivot at most, and when."""
    whole, reason = _pivot(measured)
    if whole is None:
        return Found(None, (), reason)
    times, tip, axis = _axes(measured)
    towards = whole.at_mm - tip
    beside = towards - np.einsum("ij,ij->i", towards, axis)[:, None] * axis
    away = np.linalg.norm(beside, axis=1)
    most = int(np.argmax(away))
    return Found(float(away[most]), ((float(times[most]), float(times[most])),))


FULCRUM = (
    Definition("pivot residual", SCOPE, "mm", pivot_residual_mm),
    Definition("pivot condition", SCOPE, "1", pivot_condition),
    Definition("pivot drift", SCOPE, "mm", pivot_drift_mm),
    Definition("largest excursion at the nostril", SCOPE, "mm", nostril_excursion_mm),
)
