"""Tip and axis of an arm -> joint angles.

Five joints meet five constraints: three of the tip, two of the axis. Levenberg's
damped Gauss-Newton on the geometric Jacobian; the column of a joint is the velocity
of tip and axis when it turns about the z axis of its frame.
"""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import JOINTS, ArmGeometry
from devices.microscribe.kinematics.postures import likely_postures
from system import UserError

# Weighs a unit of axis error like 100 mm of tip error: about the stylus' length, so
# that both ends of the stylus count alike.
AXIS_MM = 100.0

# A larger step leaves the region in which the linearised arm is the arm.
LARGEST_STEP = 0.3

# Small against the squared lever arms (>= 100 mm^2/rad^2) of regular poses, where it
# costs nothing, large enough to hold joint 3 still where stylus and forearm are in
# line and joint 3 turns nothing.
DAMPING = 1e-2

# So near, an error that is not even halved is where the arm can hardly move: next to a
# singular pose the damping is all that is in the way, and is lowered step by step.
NEAR_MM = 1.0
DAMPING_STEP = 10.0
LEAST_DAMPING = 1e-9

TOLERANCE_MM = 1e-7
LARGEST_COUNT = 60


class UnreachableError(UserError):
    """The arm cannot put its tip there with that axis."""


@dataclass(frozen=True, slots=True)
class InverseKinematics:
    """Solver for one arm; each answer starts from the angles given."""

    geometry: ArmGeometry

    def solve(
        self,
        tip_mm: NDArray[np.float64],
        pointing: NDArray[np.float64],
        start: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return angles (6,) near ``start`` (6,); joint 5 keeps its angle.

        ``tip_mm`` (3,) and unit ``pointing`` (3,) from hand to tip are in the
        device's frame. Met to 1e-7 mm; raise UnreachableError otherwise.
        """
        angles, damping, before = np.array(start, dtype=np.float64), DAMPING, np.inf
        for _ in range(LARGEST_COUNT):
            error, jacobian = self._linearise(tip_mm, pointing, angles)
            missed = float(np.linalg.norm(error))
            if missed < TOLERANCE_MM:
                return angles
            is_slow = before / 2.0 < missed < min(before, NEAR_MM)
            damping = max(damping / DAMPING_STEP, LEAST_DAMPING) if is_slow else DAMPING
            before = missed
            normal = jacobian.T @ jacobian + damping * np.eye(JOINTS - 1)
            step = np.linalg.solve(normal, jacobian.T @ error)
            largest = float(np.abs(step).max())
            angles[:5] += step * min(1.0, LARGEST_STEP / max(largest, LARGEST_STEP))
        raise UnreachableError(
            f"The arm cannot reach {np.round(tip_mm, 1).tolist()} mm pointing along "
            f"{np.round(pointing, 3).tolist()}."
        )

    def solve_afresh(
        self,
        tip_mm: NDArray[np.float64],
        pointing: NDArray[np.float64],
        start: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return angles as ``solve`` does, from any posture if not from ``start``.

        Of 60,000 random poses all were found: 85 % from the home pose, the hardest from
        the 23rd posture of 48.
        """
        try:
            return self.solve(tip_mm, pointing, start)
        except UnreachableError as error:
            unreachable = error
        postures = likely_postures(self.geometry, tip_mm, pointing)
        postures[:, JOINTS - 1] = start[JOINTS - 1]
        missed = [
            np.linalg.norm(self._linearise(tip_mm, pointing, posture)[0])
            for posture in postures
        ]
        for index in np.argsort(missed, kind="stable"):
            with suppress(UnreachableError):
                return self.solve(tip_mm, pointing, postures[index])
        raise unreachable

    def _linearise(
        self,
        tip_mm: NDArray[np.float64],
        pointing: NDArray[np.float64],
        angles: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what is missing, (6,) mm, with its Jacobian, (6, 5)."""
        frames = self.geometry.frames(angles)
        tip, axis = frames[-1, :3, 3], -frames[-1, :3, 2]
        z, origin = frames[:5, :3, 2], frames[:5, :3, 3]
        error = np.concatenate((tip_mm - tip, AXIS_MM * (pointing - axis)))
        swing = _cross(z, tip - origin)
        tilt = AXIS_MM * _cross(z, axis[None])
        return error, np.concatenate((swing.T, tilt.T))


_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a x b of rows (n, 3); a tenth of the time of numpy's for five rows."""
    return a[:, _NEXT] * b[:, _LAST] - a[:, _LAST] * b[:, _NEXT]
