"""An arm as it was built, which is not quite what its parameter block says."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import JOINTS, ArmGeometry
from devices.microscribe.kinematics.inverse import InverseKinematics
from devices.microscribe.kinematics.jacobian import ALPHA, BETA, PARAMETERS, ZERO, A, D
from system import UserError


@dataclass(frozen=True, slots=True, eq=False)
class KinematicErrorModel:
    """Kinematics with the constants of the metal instead of those of the block."""

    geometry: ArmGeometry
    zeros: NDArray[np.float64]
    """(6,) radians by which each joint stands ahead of what its encoder says."""

    @classmethod
    def deviating(
        cls, stated: ArmGeometry, deviation: NDArray[np.float64]
    ) -> "KinematicErrorModel":
        """Build an arm whose 25 parameters differ from the stated ones.

        ``deviation`` is (25,), in the order of ``jacobian.PARAMETER_NAMES``.
        """
        change = np.array(deviation, dtype=np.float64)
        if change.shape != (PARAMETERS,) or not np.isfinite(change).all():
            raise UserError(
                f"an arm deviates in {PARAMETERS} finite numbers, got {change}"
            )
        built = ArmGeometry(
            alpha=stated.alpha + change[ALPHA],
            a_mm=stated.a_mm + change[A],
            d_mm=stated.d_mm + change[D],
            beta=stated.beta + float(change[BETA]),
        )
        return cls(built, change[ZERO])

    def device_from_tip(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where the tip really is, (..., 4, 4), at encoder angles (..., 6)."""
        return self.geometry.device_from_tip(angles + self.zeros)

    def angles(
        self,
        tip_mm: NDArray[np.float64],
        pointing: NDArray[np.float64],
        start: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return encoder angles (6,) that really put the tip there.

        As ``InverseKinematics.solve_afresh``; raise UnreachableError as it does.
        """
        begin = start + self.zeros
        begin[JOINTS - 1] = 0.0
        solver = InverseKinematics(self.geometry)
        found = solver.solve_afresh(tip_mm, pointing, begin) - self.zeros
        found[JOINTS - 1] = 0.0
        return found
