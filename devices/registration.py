"""Rigid fit of device points to patient points.

The least-squares rotation is Kabsch's, from the singular value decomposition of the
3 x 3 covariance (W. Kabsch, Acta Cryst. A32, 1976); Horn's quaternion solution (1987)
is the same rotation. The residual at the touched points is no measure of the error
elsewhere: the target error grows with the distance from them (Fitzpatrick, 1998).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from devices.pose import Pose, read_only_rigid

# Two fiducials nearer than this cannot be told apart by a hand-held stylus.
COINCIDENT_MM = 1.0

# RMS distance of the points from their best line. At 2 mm a touching error of
# 0.2 mm already turns the patient by 6 degrees about that line.
COLLINEAR_MM = 2.0

# An arm of 0.23-0.38 mm accuracy and a steady hand stay far below this.
LARGEST_RMS_MM = 3.0

# A swapped or mirrored set is named only when undoing it explains nearly all of the
# residual; otherwise the set is merely bad.
EXPLAINED = 0.25

# 7! = 5040 orders take about half a second; larger sets are not searched.
LARGEST_SEARCH = 7


class RegistrationReason(Enum):
    """Why a set of point pairs was refused."""

    TOO_FEW = "too few points"
    COINCIDENT = "coincident points"
    COLLINEAR = "collinear points"
    SWAPPED = "swapped points"
    REFLECTED = "mirrored points"
    RESIDUAL = "residual too large"


class RegistrationError(ValueError):
    """A set of point pairs that gives no trustworthy registration."""

    def __init__(self, reason: RegistrationReason, message: str) -> None:
        super().__init__(message)
        self.reason = reason


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
) -> Registration:
    """Fit ``patient = world_from_device @ device`` to paired points.

    Both sets are (n, 3), mm, in the same order; ``names`` are used in refusals.
    Raise RegistrationError for fewer than three points, coincident or collinear
    ones, two swapped ones, a mirrored set or an rms residual above the limit. A swap
    that some rotation undoes (two points of a symmetrical flat set) cannot be seen
    in the numbers: place the fiducials unsymmetrically.
    """
    device = _points(device_points, "device_points")
    patient = _points(patient_points, "patient_points")
    if len(device) != len(patient):
        raise ValueError(
            f"each touched point needs its patient point, got {len(device)} "
            f"device points for {len(patient)} patient points"
        )
    labels = list(names) if names is not None else _numbered(len(patient))
    if len(labels) != len(patient):
        raise ValueError(f"{len(patient)} points need as many names, got {labels}")
    _refuse_degenerate(device, labels, "touched")
    _refuse_degenerate(patient, labels, "patient")
    transform, residuals = _fit(device, patient, mirror=False)
    rms = _rms(residuals)
    if rms > largest_rms_mm:
        _refuse_residual(device, patient, labels, rms, largest_rms_mm)
    return Registration(transform, rms, residuals)


def _numbered(count: int) -> list[str]:
    return [f"point {i + 1}" for i in range(count)]


def _points(points: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    array = np.array(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must have shape (n, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array.tolist()}")
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


def _fit(
    device: NDArray[np.float64], patient: NDArray[np.float64], mirror: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the best (4, 4) transform of the wanted handedness with its residuals."""
    device_mean, patient_mean = device.mean(axis=0), patient.mean(axis=0)
    u, _, vt = np.linalg.svd((patient - patient_mean).T @ (device - device_mean))
    # The smallest singular direction is the cheapest to turn round when the
    # unconstrained optimum has the other handedness.
    wanted = -1.0 if mirror else 1.0
    turn = wanted * np.sign(np.linalg.det(u) * np.linalg.det(vt))
    rotation = u @ np.diag([1.0, 1.0, turn]) @ vt
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = patient_mean - rotation @ device_mean
    registered = device @ rotation.T + transform[:3, 3]
    return transform, np.linalg.norm(registered - patient, axis=1)


def _rms(residuals: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(residuals**2)))


def _refuse_residual(
    device: NDArray[np.float64],
    patient: NDArray[np.float64],
    labels: list[str],
    rms: float,
    largest_rms_mm: float,
) -> None:
    explained = min(largest_rms_mm, EXPLAINED * rms)
    order = _better_order(device, patient, explained)
    if order is not None:
        moved = [labels[i] for i in range(len(order)) if order[i] != i]
        raise RegistrationError(
            RegistrationReason.SWAPPED,
            f"The points {', '.join(map(repr, moved))} were touched in the wrong "
            f"order (residual {rms:.1f} mm); touch them again in the order shown.",
        )
    if _rms(_fit(device, patient, mirror=True)[1]) < explained:
        raise RegistrationError(
            RegistrationReason.REFLECTED,
            f"The touched points are a mirror image of the patient's (residual "
            f"{rms:.1f} mm); left and right are exchanged in one of the two sets.",
        )
    raise RegistrationError(
        RegistrationReason.RESIDUAL,
        f"The points fit only to {rms:.1f} mm rms, {largest_rms_mm:g} mm is allowed; "
        "touch them again.",
    )


def _better_order(
    device: NDArray[np.float64], patient: NDArray[np.float64], explained: float
) -> tuple[int, ...] | None:
    """Return the order with the fewest moved points that explains the residual."""
    count = len(device)
    if count > LARGEST_SEARCH:
        return None
    orders = sorted(
        permutations(range(count)),
        key=lambda order: sum(i != j for i, j in enumerate(order)),
    )
    for order in orders[1:]:
        residuals = _fit(device[list(order)], patient, mirror=False)[1]
        if _rms(residuals) < explained:
            return order
    return None
