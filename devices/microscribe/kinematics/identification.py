"""An arm's constants from poses at known places.

Gauss-Newton on the closed parameter Jacobian. Not every constant can be seen: where
the axes of joints 1 and 2 are parallel only the sum of their offsets d moves the tip
(Hayati and Mirmirani, 1985, add an angle for that reason; the arm calls it BETA). A
set of constants that the poses cannot tell apart is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import ArmGeometry
from devices.microscribe.kinematics.error_model import BuiltArm
from devices.microscribe.kinematics.jacobian import (
    PARAMETER_NAMES,
    PARAMETERS,
    parameter_jacobian,
)
from disk import UserError

# Smallest over largest singular value of the Jacobian with columns of unit length.
# Noise of 0.1 mm over a hundred poses is then still a tenth of a degree.
SMALLEST_RATIO = 1e-4

LARGEST_COUNT = 20
TOLERANCE = 1e-13


class UnidentifiableError(UserError):
    """The poses cannot tell the wanted constants apart."""


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """Constants that explain the measured places best."""

    arm: BuiltArm
    deviation: NDArray[np.float64]
    """(25,) from the stated constants; zero where a constant was held."""
    smallest_singular: float
    """Of the Jacobian with columns of unit length; 0 would be unidentifiable."""
    residual_rms_mm: float


def identify(
    stated: ArmGeometry,
    angles: NDArray[np.float64],
    tips_mm: NDArray[np.float64],
    free: Sequence[str],
) -> Identification:
    """Find the ``free`` constants, named as in ``jacobian.PARAMETER_NAMES``.

    ``angles`` (n, 6) radians from the encoders, ``tips_mm`` (n, 3) the true places in
    the device's frame. Raise UnidentifiableError when the poses do not determine all
    free constants, ValueError for unknown names or too few poses.
    """
    unknown = [name for name in free if name not in PARAMETER_NAMES]
    if unknown or not free:
        raise UserError(f"free must name parameters of the arm, got {list(free)}")
    if angles.shape != (len(tips_mm), 6) or 3 * len(tips_mm) < len(free):
        raise UserError(
            f"{len(free)} constants need at least {-(-len(free) // 3)} poses with "
            f"their tips, got angles {angles.shape} for tips {tips_mm.shape}"
        )
    columns = [PARAMETER_NAMES.index(name) for name in free]
    deviation = np.zeros(PARAMETERS)
    smallest = 0.0
    for _ in range(LARGEST_COUNT):
        arm = BuiltArm.deviating(stated, deviation)
        missing = (tips_mm - arm.device_from_tip(angles)[:, :3, 3]).ravel()
        jacobian = parameter_jacobian(arm.geometry, angles + arm.zeros)
        reduced = jacobian[:, :3, columns].reshape(-1, len(columns))
        length = np.linalg.norm(reduced, axis=0)
        scaled = reduced / np.where(length > 0.0, length, 1.0)
        u, singular, vt = np.linalg.svd(scaled, full_matrices=False)
        smallest = float(singular[-1])
        if smallest < SMALLEST_RATIO * float(singular[0]):
            raise _unidentifiable(free, vt[-1], smallest)
        step = vt.T @ ((u.T @ missing) / singular) / length
        deviation[columns] += step
        if np.abs(step * length).max() < TOLERANCE * len(missing):
            break
    arm = BuiltArm.deviating(stated, deviation)
    left = np.linalg.norm(tips_mm - arm.device_from_tip(angles)[:, :3, 3], axis=1)
    rms = float(np.sqrt(np.mean(left**2)))
    return Identification(arm, deviation, smallest, rms)


def _unidentifiable(
    free: Sequence[str], direction: NDArray[np.float64], smallest: float
) -> UnidentifiableError:
    mixed = [
        name
        for name, part in zip(free, direction, strict=True)
        if abs(part) > 0.1 * float(np.abs(direction).max())
    ]
    return UnidentifiableError(
        f"These poses cannot tell {', '.join(mixed)} apart (smallest singular value "
        f"{smallest:.2g}); hold one of them or take poses that differ more."
    )
