"""Rigid fit of device points to patient points.

The fit is ``rigid_fit``'s; here sets that give no trustworthy registration are refused
by name. The residual at the touched points is no measure of the error elsewhere: the
target error grows with the distance from them (Fitzpatrick, West and Maurer, 1998) and
is found in ``target_error``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from devices.pose import Pose, read_only_rigid
from devices.registration.rigid_fit import best_other_order, fit_rigid, rms
from system import UserError


class RegistrationReason(Enum):
    """Why a registration was refused."""

    TOO_FEW = "too few points"
    COINCIDENT = "coincident points"
    COLLINEAR = "collinear points"
    SWAPPED = "swapped points"
    REFLECTED = "mirrored points"
    RESIDUAL = "residual too large"
    TARGET = "error at a target too large"
    SURFACE = "surface does not fit"
    FILE = "file gives no registration"


class RegistrationError(UserError):
    """A set of measurements that gives no trustworthy registration."""

    def __init__(self, reason: RegistrationReason, message: str) -> None:
        super().__init__(message)
        self.reason = reason


# Two fiducials nearer than this cannot be told apart by a hand-held stylus.
COINCIDENT_MM = 1.0

# RMS distance of the points from their best line. At 2 mm a touching error of
# 0.2 mm already turns the patient by 6 degrees about that line. What remains is judged
# by the error at the targets.
COLLINEAR_MM = 2.0

# An arm of 0.23-0.38 mm accuracy and a steady hand stay far below this.
LARGEST_RMS_MM = 3.0

# A swapped or mirrored set is named only when undoing it explains nearly all of the
# residual; otherwise the set is merely bad.
EXPLAINED = 0.25

# Below the limit a wrong order is still suspected where another one fits twice as well
# and the residual is more than an arm and a steady hand leave.
SUSPECT_RATIO = 0.5
SUSPECT_RMS_MM = 1.0

# 7! = 5040 orders take about a tenth of a second; larger sets are not searched.
LARGEST_SEARCH = 7


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """Rigid transform from the device's frame to the patient's (LPS, mm)."""

    world_from_device: NDArray[np.float64]
    """(4, 4) float64, read-only."""
    residual_rms_mm: float
    residuals_mm: NDArray[np.float64]
    """(n,) distance between each registered device point and its patient point."""

    def __post_init__(self) -> None:
        rigid = read_only_rigid(self.world_from_device, "world_from_device")
        object.__setattr__(self, "world_from_device", rigid)
        residuals = np.array(self.residuals_mm, dtype=np.float64)
        residuals.flags.writeable = False
        object.__setattr__(self, "residuals_mm", residuals)

    def world_from_tip(self, pose: Pose) -> NDArray[np.float64]:
        """Return the tip frame of ``pose`` in the patient, (4, 4) float64."""
        product: NDArray[np.float64] = self.world_from_device @ pose.device_from_tip
        return product


def register(
    device_points: NDArray[np.float64],
    patient_points: NDArray[np.float64],
    names: Sequence[str] | None = None,
    largest_rms_mm: float = LARGEST_RMS_MM,
    weights: NDArray[np.float64] | None = None,
) -> Registration:
    """Fit ``patient = world_from_device @ device`` to paired points.

    Both sets are (n, 3), mm, in the same order; ``names`` are used in refusals.
    ``weights`` (n,) are the points' inverse variances, equal when left out.
    Raise RegistrationError for fewer than three points, coincident or collinear
    ones, two swapped ones, a mirrored set or an rms residual above the limit. A swap
    that some rotation undoes (two points of a symmetrical flat set) cannot be seen
    in the numbers: place the fiducials unsymmetrically.
    """
    device = _points(device_points, "device_points")
    patient = _points(patient_points, "patient_points")
    if len(device) != len(patient):
        raise UserError(
            f"each touched point needs its patient point, got {len(device)} "
            f"device points for {len(patient)} patient points"
        )
    labels = list(names) if names is not None else _numbered(len(patient))
    if len(labels) != len(patient):
        raise UserError(f"{len(patient)} points need as many names, got {labels}")
    share = _weights(weights, len(patient))
    _refuse_degenerate(device, labels, "touched")
    _refuse_degenerate(patient, labels, "patient")
    transform, residuals = fit_rigid(device, patient, share)
    residual = rms(residuals)
    if residual > largest_rms_mm:
        _refuse_residual(device, patient, share, labels, residual, largest_rms_mm)
    elif residual > SUSPECT_RMS_MM:
        _refuse_order(
            device, patient, share, labels, residual, SUSPECT_RATIO * residual
        )
    return Registration(transform, residual, residuals)


def _weights(weights: NDArray[np.float64] | None, count: int) -> NDArray[np.float64]:
    if weights is None:
        return np.ones(count)
    array = np.array(weights, dtype=np.float64)
    if array.shape != (count,) or not (np.isfinite(array) & (array > 0.0)).all():
        raise UserError(
            f"{count} points need as many positive weights, got {weights!r}"
        )
    return array


def _numbered(count: int) -> list[str]:
    return [f"point {i + 1}" for i in range(count)]


def _points(points: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    array = np.array(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise UserError(f"{name} must have shape (n, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise UserError(f"{name} must be finite, got {array.tolist()}")
    return array


def _refuse_degenerate(
    points: NDArray[np.float64], labels: list[str], which: str
) -> None:
    count = len(points)
    if count < 3:
        raise RegistrationError(
            RegistrationReason.TOO_FEW,
            f"A registration needs at least 3 points, got {count}.",
        )
    for i in range(count):
        for j in range(i):
            gap = float(np.linalg.norm(points[i] - points[j]))
            if gap < COINCIDENT_MM:
                raise RegistrationError(
                    RegistrationReason.COINCIDENT,
                    f"The {which} points {labels[j]!r} and {labels[i]!r} are only "
                    f"{gap:.2f} mm apart; touch different places.",
                )
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    off_line = float(np.hypot(spread[1], spread[2]) / np.sqrt(count))
    if off_line < COLLINEAR_MM:
        raise RegistrationError(
            RegistrationReason.COLLINEAR,
            f"The {which} points lie on one line to within {off_line:.2f} mm; "
            "take one that is well off it.",
        )


def _refuse_order(
    device: NDArray[np.float64],
    patient: NDArray[np.float64],
    weights: NDArray[np.float64],
    labels: list[str],
    residual: float,
    explained: float,
) -> None:
    if len(device) > LARGEST_SEARCH:
        return
    order = best_other_order(device, patient, weights, explained)
    if order is not None:
        moved = [labels[i] for i in range(len(order)) if order[i] != i]
        raise RegistrationError(
            RegistrationReason.SWAPPED,
            f"The points {', '.join(map(repr, moved))} were touched in the wrong "
            f"order (residual {residual:.1f} mm); touch them again in the order shown.",
        )


def _refuse_residual(
    device: NDArray[np.float64],
    patient: NDArray[np.float64],
    weights: NDArray[np.float64],
    labels: list[str],
    residual: float,
    largest_rms_mm: float,
) -> None:
    explained = min(largest_rms_mm, EXPLAINED * residual)
    _refuse_order(device, patient, weights, labels, residual, explained)
    if rms(fit_rigid(device, patient, weights, mirror=True)[1]) < explained:
        raise RegistrationError(
            RegistrationReason.REFLECTED,
            f"The touched points are a mirror image of the patient's (residual "
            f"{residual:.1f} mm); left and right are exchanged in one of the two sets.",
        )
    raise RegistrationError(
        RegistrationReason.RESIDUAL,
        f"The points fit only to {residual:.1f} mm rms, {largest_rms_mm:g} mm is "
        "allowed; touch them again.",
    )
