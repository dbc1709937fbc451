"""Compiled: the tip frame of six counts.

The arithmetic is plain float64 in a fixed order, so the bits are those of the same
lines run by the interpreter.
"""

from math import cos, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

TILT_COSINE, TILT_SINE, SHIFT, COSINE, SINE, ANGLE, OFFSET = range(7)
"""Columns of a table of joints: b_i, a_i, alpha_i, radians a count, d_i."""


@njit("void(i8[::1],i8[::1],f8[:,::1],f8[:,::1])", cache=True)
def tip_frame(
    counts: NDArray[np.int64],
    turns: NDArray[np.int64],
    joints: NDArray[np.float64],
    frame: NDArray[np.float64],
) -> None:
    """Write the tip frame, (4, 4) mm, of six unwrapped counts.

    turns: counts a turn, 1 for a joint without encoder. joints: (6, 7).
    """
    x0, x1, x2 = 1.0, 0.0, 0.0
    y0, y1, y2 = 0.0, 1.0, 0.0
    z0, z1, z2 = 0.0, 0.0, 1.0
    p0, p1, p2 = 0.0, 0.0, 0.0
    for i in range(6):
        a, ca, sa = joints[i, SHIFT], joints[i, COSINE], joints[i, SINE]
        p0, p1, p2 = p0 + a * x0, p1 + a * x1, p2 + a * x2
        y0, y1, y2, z0, z1, z2 = (
            ca * y0 + sa * z0,
            ca * y1 + sa * z1,
            ca * y2 + sa * z2,
            ca * z0 - sa * y0,
            ca * z1 - sa * y1,
            ca * z2 - sa * y2,
        )
        cb, sb = joints[i, TILT_COSINE], joints[i, TILT_SINE]
        if sb != 0.0:
            x0, x1, x2, z0, z1, z2 = (
                cb * x0 - sb * z0,
                cb * x1 - sb * z1,
                cb * x2 - sb * z2,
                cb * z0 + sb * x0,
                cb * z1 + sb * x1,
                cb * z2 + sb * x2,
            )
        if turns[i] > 1:
            # Modulo before the angle: unwrapped counts may have grown large.
            angle = counts[i] % turns[i] * joints[i, ANGLE]
            c, s = cos(angle), sin(angle)
            x0, x1, x2, y0, y1, y2 = (
                c * x0 + s * y0,
                c * x1 + s * y1,
                c * x2 + s * y2,
                c * y0 - s * x0,
                c * y1 - s * x1,
                c * y2 - s * x2,
            )
        d = joints[i, OFFSET]
        p0, p1, p2 = p0 + d * z0, p1 + d * z1, p2 + d * z2
    frame[0, 0], frame[0, 1], frame[0, 2], frame[0, 3] = x0, y0, z0, p0
    frame[1, 0], frame[1, 1], frame[1, 2], frame[1, 3] = x1, y1, z1, p1
    frame[2, 0], frame[2, 1], frame[2, 2], frame[2, 3] = x2, y2, z2, p2
    frame[3, 0], frame[3, 1], frame[3, 2], frame[3, 3] = 0.0, 0.0, 0.0, 1.0
