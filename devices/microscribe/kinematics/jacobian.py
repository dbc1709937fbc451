"""How a tip moves when a joint turns or a constant of the arm is wrong.

Every elementary transform of a link is a screw along an axis of a known frame, so each
column has a closed form (Whitney, 1972, for the joints): turning about a unit axis w
through a point o moves the tip p by w x (p - o) and turns it by w; shifting along w
moves it by w. Rows are tip x, y, z in mm, then the rotation vector in radians, both in
the device's frame.
"""

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import BETA_JOINT, JOINTS, ArmGeometry

ALPHA = slice(0, JOINTS)
A = slice(JOINTS, 2 * JOINTS)
ZERO = slice(2 * JOINTS, 3 * JOINTS)
D = slice(3 * JOINTS, 4 * JOINTS)
BETA = 4 * JOINTS
PARAMETERS = 4 * JOINTS + 1
"""ALPHA0..5 rad, A0..5 mm, zeros of the joints 0..5 rad, D0..5 mm, BETA rad."""

PARAMETER_NAMES = (
    *(f"alpha {i}" for i in range(JOINTS)),
    *(f"a {i}" for i in range(JOINTS)),
    *(f"zero {i}" for i in range(JOINTS)),
    *(f"d {i}" for i in range(JOINTS)),
    "beta",
)


def joint_jacobian(
    geometry: ArmGeometry, angles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the change of the tip per radian of each joint, (..., 6, 6)."""
    return _joint_columns(geometry.frames(angles))


def parameter_jacobian(
    geometry: ArmGeometry, angles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the change of the tip per unit of each parameter, (..., 6, 25).

    The columns are ordered as ``PARAMETER_NAMES``.
    """
    frames = geometry.frames(angles)
    tip = frames[..., -1, :3, 3]
    before = np.empty_like(frames)
    before[..., 0, :, :] = np.eye(4)
    before[..., 1:, :, :] = frames[..., :-1, :, :]
    x, origin = before[..., :3, 0], before[..., :3, 3]
    z = frames[..., :3, 2]
    columns = np.zeros((*frames.shape[:-3], 6, PARAMETERS))
    columns[..., ALPHA] = _turns(x, origin, tip)
    columns[..., :3, A] = np.swapaxes(x, -1, -2)
    columns[..., ZERO] = _joint_columns(frames)
    columns[..., :3, D] = np.swapaxes(z, -1, -2)
    elbow = before[..., BETA_JOINT, :3, :3]
    alpha = float(geometry.alpha[BETA_JOINT])
    y = elbow @ np.array([0.0, np.cos(alpha), np.sin(alpha)])
    shoulder = before[..., BETA_JOINT, :3, 3]
    at = shoulder + float(geometry.a_mm[BETA_JOINT]) * elbow[..., 0]
    columns[..., BETA] = _turns(y[..., None, :], at[..., None, :], tip)[..., 0]
    return columns


def _joint_columns(frames: NDArray[np.float64]) -> NDArray[np.float64]:
    return _turns(frames[..., :3, 2], frames[..., :3, 3], frames[..., -1, :3, 3])


def _turns(
    axes: NDArray[np.float64], through: NDArray[np.float64], tip: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return columns (..., 6, n) of turns about axes (..., n, 3) through points."""
    swing = np.cross(axes, tip[..., None, :] - through)
    rows: NDArray[np.float64] = np.concatenate((swing, axes), axis=-1)
    return np.swapaxes(rows, -1, -2)
