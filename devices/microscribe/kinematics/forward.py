"""One packet's counts -> tip frame, at the cost of a hundred multiplications.

``ArmGeometry`` says the same for whole arrays of angles. A single pose at a time
spends there thirty times its arithmetic on making small arrays; here it is compiled.
"""

from math import cos, sin, tau

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import BETA_JOINT, JOINTS, ArmGeometry, Encoders
from system import UserError


class ForwardKinematics:
    """Forward kinematics of one arm for one set of counts at a time."""

    def __init__(self, geometry: ArmGeometry, encoders: Encoders) -> None:
        # Imported here: this module's names are needed where nothing is compiled.
        from devices.microscribe.kernels.tip_frame import tip_frame

        self._tip_frame = tip_frame
        self._turns = np.array(encoders.turn, dtype=np.int64)
        self._joints = np.empty((JOINTS, 7))
        for i, joint in enumerate(self._joints):
            tilt = geometry.beta if i == BETA_JOINT else 0.0
            joint[:] = (
                cos(tilt),
                sin(tilt),
                geometry.a_mm[i],
                cos(geometry.alpha[i]),
                sin(geometry.alpha[i]),
                tau / encoders.turn[i],
                geometry.d_mm[i],
            )

    def device_from_tip(self, counts: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the tip frame, (4, 4) mm, from six unwrapped counts, (6,) int64."""
        if len(counts) != JOINTS:
            raise UserError(f"an arm has {JOINTS} counts, got {counts}")
        frame = np.empty((4, 4))
        self._tip_frame(counts, self._turns, self._joints, frame)
        return frame
