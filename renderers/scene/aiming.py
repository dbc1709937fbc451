"""From where one stands and what one looks at to a camera's axes."""

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from system import UserError

PARALLEL_RAD = 1e-6
"""An up nearer than this to the view axis tells nothing. In float64 the cross product
is good to far less."""


class UpWarning(UserWarning):
    """That the direction given for up told nothing, and which was taken."""


def aimed(
    eye_mm: ArrayLike,
    target_mm: ArrayLike,
    up: ArrayLike,
    right_before: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Return ``(4, 3)`` eye, right, up and forward of a view from place to place.

    up: roughly upwards. Parallel to the view it tells nothing: then right stays as near
    as can be to `right_before`, if that is given, and else the world's axis that is
    least aligned with the view (the first of those alike) is up; an `UpWarning` says
    so. Raises UserError where the two places are one, or a number is not finite.
    """
    eye = np.asarray(eye_mm, dtype=np.float64)
    forward = np.asarray(target_mm, dtype=np.float64) - eye
    upwards = np.asarray(up, dtype=np.float64)
    length = np.linalg.norm(forward)
    if not (np.isfinite(length) and length > 0):
        raise UserError(
            f"cannot aim from {eye} at {target_mm!r}: the points coincide, or are "
            "not finite"
        )
    if not (np.isfinite(upwards).all() and upwards.any()):
        raise UserError(
            f"up must be a direction, three finite numbers that are not all zero; got "
            f"{up!r}"
        )
    forward /= length
    upwards = upwards / np.abs(upwards).max()
    right = np.cross(forward, upwards / np.linalg.norm(upwards))
    if np.linalg.norm(right) < PARALLEL_RAD:
        upwards, what = _instead(forward, right_before)
        warnings.warn(
            f"up {np.asarray(up).tolist()} is parallel to the view; {what}",
            UpWarning,
            stacklevel=3,
        )
        right = np.cross(forward, upwards)
    right /= np.linalg.norm(right)
    return np.stack([eye, right, np.cross(right, forward), forward])


def _instead(
    forward: NDArray[np.float64], right_before: ArrayLike | None
) -> tuple[NDArray[np.float64], str]:
    if right_before is not None:
        upwards = np.cross(np.asarray(right_before, dtype=np.float64), forward)
        if np.linalg.norm(upwards) > PARALLEL_RAD:
            return upwards, "what was right before stays on the right"
    upwards = np.eye(3)[np.abs(forward).argmin()]
    return upwards, f"{upwards.astype(int).tolist()} is taken for it"
