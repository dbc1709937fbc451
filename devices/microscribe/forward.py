"""One packet's counts -> tip frame, at the cost of a hundred multiplications.

``ArmGeometry`` says the same for whole arrays of angles. A single pose at a time
spends there thirty times its arithmetic on making small arrays; here it is plain
floats, the frame's three axes carried from joint to joint.
"""

from collections.abc import Sequence
from math import cos, sin, tau

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.arm import BETA_JOINT, JOINTS, ArmGeometry, Encoders


class ForwardKinematics:
    """Forward kinematics of one arm for one set of counts at a time."""

    def __init__(self, geometry: ArmGeometry, encoders: Encoders) -> None:
        self._cos_beta, self._sin_beta = cos(geometry.beta), sin(geometry.beta)
        self._joints = tuple(
            (
                i == BETA_JOINT and geometry.beta != 0.0,
                float(geometry.a_mm[i]),
                cos(geometry.alpha[i]),
                sin(geometry.alpha[i]),
                encoders.turn[i],
                tau / encoders.turn[i],
                float(geometry.d_mm[i]),
            )
            for i in range(JOINTS)
        )

    def device_from_tip(self, counts: Sequence[int]) -> NDArray[np.float64]:
        """Return the tip frame, (4, 4) mm, from six unwrapped counts."""
        x0, x1, x2 = 1.0, 0.0, 0.0
        y0, y1, y2 = 0.0, 1.0, 0.0
        z0, z1, z2 = 0.0, 0.0, 1.0
        p0 = p1 = p2 = 0.0
        for (tilted, a, ca, sa, turn, step, d), count in zip(
            self._joints, counts, strict=True
        ):
            p0, p1, p2 = p0 + a * x0, p1 + a * x1, p2 + a * x2
            y0, y1, y2, z0, z1, z2 = (
                ca * y0 + sa * z0,
                ca * y1 + sa * z1,
                ca * y2 + sa * z2,
                ca * z0 - sa * y0,
                ca * z1 - sa * y1,
                ca * z2 - sa * y2,
            )
            if tilted:
                cb, sb = self._cos_beta, self._sin_beta
                x0, x1, x2, z0, z1, z2 = (
                    cb * x0 - sb * z0,
                    cb * x1 - sb * z1,
                    cb * x2 - sb * z2,
                    cb * z0 + sb * x0,
                    cb * z1 + sb * x1,
                    cb * z2 + sb * x2,
                )
            if turn > 1:
                # Modulo before the angle: unwrapped counts may have grown large.
                angle = count % turn * step
                c, s = cos(angle), sin(angle)
                x0, x1, x2, y0, y1, y2 = (
                    c * x0 + s * y0,
                    c * x1 + s * y1,
                    c * x2 + s * y2,
                    c * y0 - s * x0,
                    c * y1 - s * x1,
                    c * y2 - s * x2,
                )
            p0, p1, p2 = p0 + d * z0, p1 + d * z1, p2 + d * z2
        rows = (x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2, 0.0, 0.0, 0.0, 1.0)
        return np.array(rows).reshape(4, 4)
