"""Errors of touched points and of targets, from what is known of the arm.

Joint angles are found anew from the poses. An arm can hold most poses in several ways,
by its elbow and its wrist, and an error of its constants moves each in its own way.
What touches and targets share cancels only where one way is taken for all: see
`ArmErrors.held_as`.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import JOINTS, ArmGeometry, Encoders, TipChange
from devices.microscribe.kinematics.inverse import InverseKinematics
from devices.microscribe.kinematics.profiles import HOME_COUNTS
from devices.microscribe.kinematics.uncertainty import ArmUncertainty, ParameterSpread
from devices.registration.target_error import PointErrors


@dataclass(frozen=True, slots=True, eq=False)
class ArmErrors:
    """What makes the poses of one arm with one tip wrong."""

    geometry: ArmGeometry
    encoders: Encoders
    spread: ParameterSpread
    tip_mm: NDArray[np.float64]
    """(3,) calibrated tip in the frame of the stated one."""
    tip_covariance: NDArray[np.float64]
    """(3, 3) mm^2 in the same frame; zeros for a tip that is known."""
    near: NDArray[np.float64] | None = None
    """(6,) radians from which a pose's joint angles are looked for; None for rest."""

    def held_as(self, device_from_tip: NDArray[np.float64]) -> "ArmErrors":
        """Return the errors of an arm whose elbow and wrist stay as in a pose (4, 4).

        Which of several ways that is, a pose does not tell: the first that is found.
        """
        return replace(self, near=self.angles(device_from_tip[None])[0])

    def at(
        self,
        device_from_tip: NDArray[np.float64],
        world_from_device: NDArray[np.float64],
        own_noise: NDArray[np.float64],
    ) -> PointErrors:
        """Return the errors in the patient of tips at frames (n, 4, 4).

        The frames have their origin at the calibrated tip. ``own_noise`` (n, 3, 3) is
        the covariance of each point beside the rounding of counts, device frame. The
        shared causes are the arm's 25 constants, then the three of its tip.
        """
        arm = ArmUncertainty(self._on_tip(), self.encoders, self.spread)
        angles = self.angles(device_from_tip)
        into_world = world_from_device[:3, :3]
        rounding = arm.quantisation(angles)[:, :3, :3]
        noise = into_world @ (rounding + own_noise) @ into_world.T
        constants = into_world @ arm.common_factor(angles)[:, :3]
        values, vectors = np.linalg.eigh(self.tip_covariance)
        tip = vectors * np.sqrt(np.maximum(values, 0.0))
        turned = into_world @ device_from_tip[:, :3, :3] @ tip
        return PointErrors(noise, np.concatenate((constants, turned), axis=2))

    def angles(self, device_from_tip: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return joint angles (n, 6) at frames (n, 4, 4) of the calibrated tip.

        Raise UnreachableError for a frame that the arm cannot have.
        """
        solver = InverseKinematics(self._on_tip())
        angles = self.near
        if angles is None:
            angles = self.encoders.angles(np.array(HOME_COUNTS))
            angles[JOINTS - 1] = 0.0
        found = []
        for frame in device_from_tip:
            angles = solver.solve_afresh(frame[:3, 3], -frame[:3, 2], angles)
            found.append(angles)
        return np.array(found).reshape(-1, JOINTS)

    def _on_tip(self) -> ArmGeometry:
        # Only along the stylus: a tip beside the axis changes where the point is and
        # hardly how it moves.
        return self.geometry.with_tip(TipChange(longer_mm=-float(self.tip_mm[2])))
