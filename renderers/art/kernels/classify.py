"""Look densities up in a `Classification`, lane by lane."""

import numpy as np
from numba import njit

from renderers.art.kernels.march_types import F32, I32, Lanes, Three
from renderers.art.kernels.opacity import ONE, ZERO
from renderers.simd import (
    any_,
    f32,
    gather,
    i32,
    maximum,
    minimum,
    rows4,
    rows8,
    select,
)


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
def classify(
    lines: F32, first: I32, extinction: F32, color: F32, slope: F32,
    bins: Three, v: Lanes, at: Lanes,
) -> tuple[Lanes, Lanes, Lanes, Lanes, Lanes, Lanes]:  # fmt: skip
    """Return extinction and colour of densities, their bins, and which bins hold nodes.

    bins: low, scale and last of a `Classification`; the arrays are its, too.
    """
    place = minimum(maximum((v - bins[0]) * bins[1] + ONE, ZERO), bins[2])
    bin_ = i32(place)
    f = place - f32(bin_)
    kappa, dk, r, dr, g, dg, b, db = rows8(lines, bin_)
    kappa, r, g, b = kappa + f * dk, r + f * dr, g + f * dg, b + f * db
    mixed = at & (kappa < ZERO)
    if any_(mixed):
        kappa, r, g, b = between_nodes(
            first, extinction, color, slope, bin_, v, mixed, kappa, r, g, b
        )
    return kappa, r, g, b, bin_, mixed
