"""Where a point of one head lies in the average one: a sum of a few slow waves."""

import math

import numpy as np
from numba import njit

from anatomy.kernels.tables import Floats

F1, F2, F4 = np.float32(1), np.float32(2), np.float32(4)
_FLAT, _ROUND = np.float32(0.775), np.float32(0.225)


@njit(cache=True, nogil=True, error_model="numpy")
def displace(p: Floats, n: int, waves: Floats) -> None:
    """Move RAS points ``(3, n)``, mm, in place.

    waves ``(1 + k, 7)``: in row 0 what is added to all, x, y, z, and 1 / the half width
    of the middle, where nothing moves sideways; then of each wave its vector, cycles a
    mm, its phase, and its amplitude, mm. No rows: nothing moves.
    """
    if waves.shape[0] == 0:
        return
    moves = np.empty((3, n), np.float32)
    for axis in range(3):
        moves[axis] = waves[0, axis]
    dx, dy, dz = moves[0], moves[1], moves[2]
    px, py, pz = p[0], p[1], p[2]
    for k in range(1, waves.shape[0]):
        a, b, c, d = waves[k, 0], waves[k, 1], waves[k, 2], waves[k, 3]
        ax, ay, az = waves[k, 4], waves[k, 5], waves[k, 6]
        for i in range(n):
            cycles = a * px[i] + b * py[i] + c * pz[i] + d
            at = F2 * (cycles - np.floor(cycles)) - F1
            # two parabolas, rounded: a sine but for .0011
            wave = F4 * at * (F1 - abs(at))
            wave *= _FLAT + _ROUND * abs(wave)
            dx[i] += ax * wave
            dy[i] += ay * wave
            dz[i] += az * wave
    for i in range(n):
        middle = waves[0, 3] * px[i]
        px[i] += dx[i] * (F1 - np.float32(math.exp(-(middle * middle))))
        py[i] += dy[i]
        pz[i] += dz[i]
