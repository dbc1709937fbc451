"""Look densities up in a `Classification`, lane by lane."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.opacity import ONE, ZERO
from renderers.lanes import any_, gather, maximum, minimum, rows4, select

Lanes = Any
"""A vector of `renderers.lanes`."""

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


@njit(cache=True, nogil=True, error_model="numpy")
def between_nodes(
    first: I32, extinction: F32, color: F32, slope: F32, bin_: Lanes, v: Lanes,
    mixed: Lanes, kappa: Lanes, r: Lanes, g: Lanes, b: Lanes,
) -> tuple[Lanes, Lanes, Lanes, Lanes]:  # fmt: skip
    """Classify by the user's own nodes where a bin holds one.

    Seldom needed, so a function of its own: in line it costs the march registers, and
    that a seventh of its time.
    """
    segment = gather(first, select(mixed, bin_, 0), mixed)
    lower, upper, k0, k1 = rows4(extinction, segment)
    later = mixed & (v >= upper)
    while any_(later):
        segment = select(later, segment + np.int32(1), segment)
        lower, upper, k0, k1 = rows4(extinction, segment)
        later = mixed & (v >= upper)
    dv = maximum(v - lower, ZERO)
    kappa = select(mixed, k0 + dv * k1, kappa)
    a0, a1, a2, _ = rows4(color, segment)
    k0, k1, k2, _ = rows4(slope, segment)
    r = select(mixed, a0 + dv * k0, r)
    g = select(mixed, a1 + dv * k1, g)
    b = select(mixed, a2 + dv * k2, b)
    return kappa, r, g, b


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def place_of(v: Lanes, low: np.float32, scale: np.float32, last: np.float32) -> Lanes:
    """Count bins up to a density, fractions included."""
    return minimum(maximum((v - low) * scale + ONE, ZERO), last)
