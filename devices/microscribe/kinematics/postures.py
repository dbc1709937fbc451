"""The ways in which an arm may hold its tip: nearly, as starts for the exact solver.

All is known once the wrist's axis is, which stands across the stylus: one angle. Then
shoulder and elbow are two sides of a triangle, as of any arm with its angles at right
angles; what an arm deviates from that is left to the solver.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import JOINTS, ArmGeometry

WRIST_AXES = 12
"""Axes of the wrist that are tried all round the stylus."""


def likely_postures(
    geometry: ArmGeometry, tip_mm: NDArray[np.float64], pointing: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return angles (n, 6) near all that hold the tip (3,) pointing so, unit (3,).

    Of most, the stylus does not point as it should: the nearer it does, the nearer is
    a posture that holds it.
    """
    a, d = geometry.a_mm, geometry.d_mm
    turn = np.arange(WRIST_AXES) * (2.0 * np.pi / WRIST_AXES)
    across = np.cross(pointing, np.eye(3)[np.abs(pointing).argmin()])
    across /= np.linalg.norm(across)
    beside = np.cross(pointing, across)
    axis = np.outer(np.cos(turn), across) + np.outer(np.sin(turn), beside)
    wrist = tip_mm + d[5] * pointing + a[5] * np.cross(pointing, axis) - d[4] * axis
    found = []
    for shoulder, elbow in product((1.0, -1.0), repeat=2):
        angles = _reaching(geometry, wrist, shoulder, elbow)
        # the wrist's axis stands a little beside the forearm, which is known by now
        forearm = geometry.frames(angles)[:, 3, :3, 2]
        end = wrist - a[4] * np.cross(axis, forearm)
        angles = _reaching(geometry, end, shoulder, elbow)
        x, y, _ = _seen_from(geometry, angles, 3, axis)
        angles[:, 3] = np.arctan2(-x, y)
        x, y, _ = _seen_from(geometry, angles, 4, np.broadcast_to(pointing, axis.shape))
        angles[:, 4] = np.arctan2(x, -y)
        found.append(angles)
    return np.concatenate(found)


def _reaching(
    geometry: ArmGeometry, place_mm: NDArray[np.float64], shoulder: float, elbow: float
) -> NDArray[np.float64]:
    """Return angles (n, 6) whose forearms end at places (n, 3), or reach for them.

    shoulder, elbow: 1 or -1, on which side they are.
    """
    a, d = geometry.a_mm, geometry.d_mm
    x, y, z = place_mm.T
    aside = -d[1] - d[2]
    ahead = shoulder * np.sqrt(np.maximum(x * x + y * y - aside * aside, 0.0))
    angles = np.zeros((len(place_mm), JOINTS))
    angles[:, 0] = np.arctan2(y, x) - np.arctan2(aside, ahead)
    out, up = ahead - a[1], z - d[0]
    upper, fore = a[2], np.hypot(a[3], d[3])
    cosine = (out * out + up * up - upper * upper - fore * fore) / (2.0 * upper * fore)
    bent = elbow * np.arccos(np.clip(cosine, -1.0, 1.0))
    behind = np.arctan2(fore * np.sin(bent), upper + fore * np.cos(bent))
    angles[:, 1] = np.arctan2(up, out) - behind
    angles[:, 2] = bent - np.arctan2(-d[3], a[3])
    return angles


def _seen_from(
    geometry: ArmGeometry,
    angles: NDArray[np.float64],
    joint: int,
    directions: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return directions (n, 3) in the frames of a joint that is not turned, (3, n)."""
    turns = geometry.frames(angles)[:, joint, :3, :3]
    seen: NDArray[np.float64] = np.einsum("nij,ni->jn", turns, directions)
    return seen
