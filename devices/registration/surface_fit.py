"""Refine a registration on a surface that was traced with the stylus.

Iterated closest points with the distance to the tangent plane (Chen and Medioni, 1992)
together with the landmarks: Gauss-Newton on

    sum_i |T a_i - b_i|^2_{W_i}  +  sum_j rho(phi(T s_j) / sigma)

where phi is the signed distance to the surface. The landmarks hold what the surface
leaves free: a smooth patch slides along itself. Traced points far from the surface
(the stylus was lifted) count less and less (Huber).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.registration.fiducial_fit import RegistrationError, RegistrationReason
from devices.registration.target_error import moves
from system import UserError

# A landmark start is within a few mm and a fraction of a degree of its end.
LARGEST_COUNT = 50
TOLERANCE = 1e-10

# Huber's constant: 95 % efficient on normal errors.
HUBER = 1.345

FEWEST_POINTS = 30

# Where even the median traced point is this far away, it is another surface.
LARGEST_MEDIAN_MM = 1.0


class TracedSurface(Protocol):
    """The boundary that the stylus traces, in the patient's frame."""

    def distance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return signed distances (n,), mm, of points (n, 3); negative in air."""
        ...

    def normal(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the gradient (n, 3) of the distance there, about unit length."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Landmarks:
    """Touched points (n, 3), where they belong (n, 3), how sure (n, 3, 3)."""

    device_mm: NDArray[np.float64]
    patient_mm: NDArray[np.float64]
    weights: NDArray[np.float64]
    """Inverse covariances in the patient's frame, 1 / mm^2."""


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """A refined registration with what held it."""

    world_from_device: NDArray[np.float64]
    points: NDArray[np.float64]
    """(n + m, 3) landmarks, then traced points, in the patient."""
    weights: NDArray[np.float64]
    """(n + m, 3, 3) with which each of them pulled."""
    surface_rms_mm: float
    """Of the traced points about the surface; 0 without any."""


def refine(
    start: NDArray[np.float64],
    landmarks: Landmarks,
    traced_mm: NDArray[np.float64],
    surface: TracedSurface | None,
    surface_mm: float,
) -> Refinement:
    """Refine world_from_device from ``start``, (4, 4).

    ``traced_mm`` (m, 3) are points of the surface in the device's frame, empty for a
    fit to the landmarks' covariances alone; ``surface_mm`` is their standard error
    across the surface. Raise RegistrationError(SURFACE) for too few traced points or
    a trace that lies elsewhere.
    """
    traced = traced_mm.reshape(-1, 3)
    if surface is None and len(traced):
        raise UserError("traced points need the surface on which they lie")
    if 0 < len(traced) < FEWEST_POINTS:
        raise RegistrationError(
            RegistrationReason.SURFACE,
            f"The trace has {len(traced)} points, {FEWEST_POINTS} are needed; trace a "
            "larger patch.",
        )
    transform = np.array(start, dtype=np.float64)
    count = len(landmarks.device_mm)
    for _ in range(LARGEST_COUNT):
        points, weights, missing = _pulls(
            transform, landmarks, traced, surface, surface_mm
        )
        centre = points[:count].mean(axis=0)
        rows = moves(points, centre)
        pulled = np.swapaxes(rows, -1, -2) @ weights
        normal = (pulled @ rows).sum(axis=0)
        step = np.linalg.solve(normal, (pulled @ missing[..., None]).sum(axis=0))[:, 0]
        transform = _moved(transform, step, centre)
        if np.linalg.norm(step[:3]) + 100.0 * np.linalg.norm(step[3:]) < TOLERANCE:
            break
    points, weights, missing = _pulls(transform, landmarks, traced, surface, surface_mm)
    off = np.linalg.norm(missing[count:], axis=1)
    if len(off) and float(np.median(off)) > LARGEST_MEDIAN_MM:
        raise RegistrationError(
            RegistrationReason.SURFACE,
            f"The points lie {np.median(off):.1f} mm off the patient's surface in the "
            "median; check that they are of this patient's skin. A stylus must not be "
            "lifted while it traces.",
        )
    fit = float(np.sqrt(np.mean(off**2))) if len(off) else 0.0
    return Refinement(transform, points, weights, fit)


def _pulls(
    transform: NDArray[np.float64],
    landmarks: Landmarks,
    traced: NDArray[np.float64],
    surface: TracedSurface | None,
    surface_mm: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return points, weights and the ways by which the points are off."""
    rotation, shift = transform[:3, :3], transform[:3, 3]
    points = landmarks.device_mm @ rotation.T + shift
    missing = landmarks.patient_mm - points
    if surface is None:
        return points, landmarks.weights, missing
    on = traced @ rotation.T + shift
    distance, normal = surface.distance(on), surface.normal(on)
    far = np.abs(distance) / surface_mm
    pull = np.minimum(1.0, HUBER / np.maximum(far, 1e-12)) / surface_mm**2
    weights = pull[:, None, None] * (normal[:, :, None] * normal[:, None, :])
    return (
        np.concatenate((points, on)),
        np.concatenate((landmarks.weights, weights)),
        np.concatenate((missing, -distance[:, None] * normal)),
    )


def _moved(
    transform: NDArray[np.float64],
    step: NDArray[np.float64],
    centre: NDArray[np.float64],
) -> NDArray[np.float64]:
    turn = np.asarray(Rotation.from_rotvec(step[3:]).as_matrix(), dtype=np.float64)
    moved = np.eye(4)
    moved[:3, :3] = turn @ transform[:3, :3]
    moved[:3, 3] = turn @ (transform[:3, 3] - centre) + centre + step[:3]
    return moved
