"""Composite the solids behind mucosa and bone shells, as the scan shows them."""

import math

import numpy as np
from numba import njit

from anatomy.kernels.stack_program import grain_at, run_program
from anatomy.kernels.tables import POINT_ROWS, Bools, Bytes, Floats, Tables

F0, F1 = np.float32(0), np.float32(1)
CLEAR = np.float32(4)
"""Standard deviations of the blur beyond which an edge is not seen."""

UNEVEN = np.float32(0.3)
"""Standard deviation of the thickness of a sheet of bone over its mean."""
THICKEST = np.float32(2)
"""A sheet is nowhere thicker than this many times its mean."""
LEAST_SHARE = np.float32(0.02)
"""Grain of what covers less of a voxel is not seen."""


@njit(cache=True, nogil=True, error_model="numpy")
def _coverage(x: np.float32) -> np.float32:
    """Return the normal distribution function, exactly 0 and 1 at +-CLEAR."""
    if x >= CLEAR:
        return F1
    if x <= -CLEAR:
        return F0
    return np.float32(0.5 * math.erfc(-x * 0.7071067811865476))


@njit(cache=True, nogil=True, error_model="numpy")
def paint_ground(
    p: Floats,
    n: int,
    layer: int,
    t: Tables,
    seen: Bools,
    sharp: np.float32,
    work: Floats,
    kept: Floats,
    label: Bytes,
) -> None:
    """Composite the solids from the last to the first until nothing shows through.

    p: ``(3, n)`` RAS points, for the bone's grain. layer: see `run_program`. seen:
    which solids may reach the block. work: see `Scratch`, with the side's points; row 9
    becomes HU.
    """
    side_p, noise, stack = work[0:4], work[4:6], work[POINT_ROWS:]
    # clear: what still shows through; most: the greatest share so far
    hu, clear, most = work[9], work[10], work[11]
    clear[:n], hu[:n], most[:n] = F1, F0, F0
    label[:n] = 0
    for q in range(t.solids.shape[0] - 1, -1, -1):
        if not seen[q]:
            continue
        row, half = int(t.solids[q, 0]), t.solids[q, 1] * sharp
        if row < 0:
            begin, end = t.ground[q, 0], t.ground[q, 1]
            run_program(
                t.code, t.constants, begin, end, side_p, noise, n, layer, stack, kept
            )
        value = stack[0] if row < 0 else kept[row]
        left, grain = F0, t.solids[q, 6]
        for i in range(n):
            d = (value[i] - t.solids[q, 4]) * sharp
            if half > F0:
                e, thick = abs(d), half
                if grain > F0 and e < THICKEST * half + CLEAR:
                    rough = grain_at(
                        p[0, i], p[1, i], p[2, i], 0, t.grain, t.perm, t.grad
                    )
                    thick *= min(max(F1 + UNEVEN * rough, F0), THICKEST)
                w = _coverage(thick - e) - _coverage(-thick - e)
            else:
                w = _coverage(-d)
            share = clear[i] * w
            hu[i] += share * t.solids[q, 2]
            if grain > F0 and share > LEAST_SHARE:
                hu[i] += (
                    share
                    * grain
                    * grain_at(p[0, i], p[1, i], p[2, i], 1, t.grain, t.perm, t.grad)
                )
            if share > most[i]:
                most[i] = share
                label[i] = np.uint8(t.solids[q, 3])
            clear[i] *= F1 - w
            left = max(left, clear[i])
        if left == F0:
            break
