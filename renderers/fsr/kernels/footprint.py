"""The footprint of a splat: its Gaussian fall-off and the opacity of its centre.

A voxel is drawn as a Gaussian that is cut at three sigma and lowered to end at zero
there (Westover, Footprint evaluation for volume rendering, SIGGRAPH 1990). Kernels use
two polynomials in its place.

Fall-off. With z the squared distance over that of the cut, ``y = SCALE z - SHIFT``,
``q = y^2 + BEND`` and ``r = q (q - y) + LIFT``, the weight ``(r^2 - REST) WEIGHT`` is
one at the centre, z = 0, and zero at the cut, z = 1. It differs from the Gaussian by
1.2e-4 of its peak at most; its integral is right to 1e-5.

Peak. Splats are blended one by one, so the peak that gives a sheet of them the optical
depth t has to be solved for: neither the sheet's opacity (.866 for .7) nor t shared
out by area (.651 for .7) gives it. ``t (p0 + t (p1 + ... t p5))`` is within 3e-7 of
the solution for `SIGMA_PER_SPACING`.
"""

import math

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, Lanes
from renderers.fsr.kernels.tile_buffer import SQUARE
from renderers.simd import as_f32, floor, fma, i32, maximum, minimum, select, spread

SIGMA_PER_SPACING = 0.6
"""In [.55, .70] the cut, not the spacing, makes the ripple."""
CUT = 3.0
"""Sigmas at which a footprint ends. 1.1 % of the mass lies outside; at 2 sigma it is
13.5 % and ripples by .15."""
ANTIALIAS = 0.3
"""Squared pixels added to a footprint's covariance, so that small ones keep mass."""

SCALE = np.float32(1.027436)
SHIFT = np.float32(0.77932185)
BEND = np.float32(0.3903702)
LIFT = np.float32(1.1854086)
EDGE = SCALE - SHIFT
"""y at the cut."""
CUT_SHARE = SCALE / np.float32(CUT**2)
"""`SCALE` times the squared distance of one sigma over that of the cut."""


def _raised(y: np.float32) -> np.float32:
    """Evaluate r^2 as kernels do, to the bit at the cut."""
    q = y * y + BEND
    r = q * (q - y) + LIFT
    return r * r


REST = _raised(EDGE)
WEIGHT = np.float32(1) / (_raised(-SHIFT) - REST)

PEAK = tuple(
    np.float32(p)
    for p in (
        4.65638346e-01,
        -5.58564020e-02,
        1.76992574e-03,
        -5.26490919e-05,
        -1.64888089e-05,
        4.96536370e-06,
    )
)
"""p0 to p5."""
DEEPEST = np.float32(3.4)
"""Optical depth from which on a peak is one: denser a sheet cannot be."""

_LOG2E = np.float32(1 / math.log(2))
_POWER = tuple(np.float32(math.log(2) ** k / math.factorial(k)) for k in range(1, 7))
"""2^x on -0.5..0.5."""
_ONE = np.float32(1)
_HALF = np.float32(0.5)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def gaussian_falloff(records: F32, o: int, u: Lanes, v: Lanes) -> Lanes:
    """Weigh pixels: zero from the cut on; `WEIGHT` times this is one at the centre.

    o: where the splat's record begins, see `RECORD`. u, v: the pixels' centres.
    """
    dx = u - spread(records, o, SQUARE)
    dy = v - spread(records, o + 1, SQUARE)
    slim, flat = spread(records, o + 2, SQUARE), spread(records, o + 4, SQUARE)
    beside = fma(dx, slim, dy * spread(records, o + 3, SQUARE))
    y = minimum(fma(dx, beside, fma(dy * dy, flat, -SHIFT)), EDGE)
    q = fma(y, y, BEND)
    r = fma(q, q - y, LIFT)
    # rounded twice: nothing is left at the cut
    return r * r - REST


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def peak_of(depth: Lanes) -> Lanes:
    """Return the peak opacity for optical depths >= 0."""
    t = minimum(depth, DEEPEST)
    p = t * PEAK[5] + PEAK[4]
    p = p * t + PEAK[3]
    p = p * t + PEAK[2]
    p = p * t + PEAK[1]
    p = p * t + PEAK[0]
    return p * t


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def absorbed(depth: Lanes) -> Lanes:
    """Return 1 - exp(-depth) for optical depths >= 0."""
    p = depth * np.float32(-1 / 720) + np.float32(1 / 120)
    p = p * depth - np.float32(1 / 24)
    p = p * depth + np.float32(1 / 6)
    p = p * depth - _HALF
    thin = depth * (p * depth + _ONE)
    y = maximum(-depth * _LOG2E, np.float32(-126))
    n = floor(y + _HALF)
    f = y - n
    p = f * _POWER[5] + _POWER[4]
    p = p * f + _POWER[3]
    p = p * f + _POWER[2]
    p = p * f + _POWER[1]
    p = p * f + _POWER[0]
    p = p * f + _ONE
    rest = p * as_f32((i32(n) + 127) << 23)
    return select(depth < np.float32(0.25), thin, _ONE - rest)
