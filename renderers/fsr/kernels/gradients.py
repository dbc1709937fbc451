"""Sobel's gradient of a volume, from all 26 neighbours of a voxel.

Normals point against the gradient: to lower density, towards the air.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, Lanes


class FlatVolume(NamedTuple):
    """A volume as sweeps take it.

    values: flat, x fastest; nx, ny, nz: voxels. half: 1 / (32 * spacing) in x, y, z
    order: a Sobel sum over nine differences of weight 1 2 1 x 1 2 1 spans 16 weights
    and two spacings. direction: ``(3, 3)``, the axes in columns.
    """

    values: F32
    nx: int
    ny: int
    nz: int
    half: F32
    direction: F32


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def sobel(
    values: F32, nx: int, ny: int, nz: int, i: int, j: int, k: int,
) -> tuple[Lanes, Lanes, Lanes]:  # fmt: skip
    """Sum the Sobel differences along x, y, z at one voxel; the edge is repeated."""
    im = max(i - 1, 0)
    ip = min(i + 1, nx - 1)
    jm = max(j - 1, 0) * nx
    jp = min(j + 1, ny - 1) * nx
    jc = j * nx
    km = max(k - 1, 0) * (nx * ny)
    kp = min(k + 1, nz - 1) * (nx * ny)
    kc = k * (nx * ny)
    a = km + jm
    b = km + jc
    c = km + jp
    d = kc + jm
    e = kc + jc
    f = kc + jp
    g = kp + jm
    h = kp + jc
    m = kp + jp
    # nine rows of three: low, middle and high x
    al, ac, ah = values[a + im], values[a + i], values[a + ip]
    bl, bc, bh = values[b + im], values[b + i], values[b + ip]
    cl, cc, ch = values[c + im], values[c + i], values[c + ip]
    dl, dc, dh = values[d + im], values[d + i], values[d + ip]
    el, eh = values[e + im], values[e + ip]
    fl, fc, fh = values[f + im], values[f + i], values[f + ip]
    gl, gc, gh = values[g + im], values[g + i], values[g + ip]
    hl, hc, hh = values[h + im], values[h + i], values[h + ip]
    ml, mc, mh = values[m + im], values[m + i], values[m + ip]
    two = np.float32(2)
    x = ((ah - al) + (ch - cl) + (gh - gl) + (mh - ml)) + (
        two * ((bh - bl) + (dh - dl) + (fh - fl) + (hh - hl)) + two * two * (eh - el)
    )
    sa = al + two * ac + ah
    sc = cl + two * cc + ch
    sg = gl + two * gc + gh
    sm = ml + two * mc + mh
    sb = bl + two * bc + bh
    sd = dl + two * dc + dh
    sf = fl + two * fc + fh
    sh = hl + two * hc + hh
    y = (sc - sa) + two * (sf - sd) + (sm - sg)
    z = (sg - sa) + two * (sh - sb) + (sm - sc)
    return x, y, z
