"""Compiled: powers, tone curve, grain and sRGB code, row by row.

A row of planes is three channels of `pitch` values (see the exposing kernels).
Each stage goes over a whole row: loops with little in them compile fast, and have
room for vectors of 64, enough operations that do not wait for each other.
Polynomials are minimax fits, evaluated in pairs of terms: a shorter chain of
operations that wait for each other than Horner's, with the same bits everywhere.
"""
# Vectors are types of the compiler alone, which functions that take them cannot name.
# mypy: disable-error-code="no-untyped-def"

import numpy as np
from numba import njit

from renderers.simd import (
    any_,
    as_f32,
    as_i32,
    load,
    maximum,
    minimum,
    select,
    sqrt,
    store,
)
from renderers.simd import f32 as to_f32
from renderers.simd import i32 as to_i32
from renderers.simd.arrays import Bytes, Floats, f32, i32

W = 32

ROUNDING = f32(3 << 22)
"""Added to a small number it leaves no bits below one."""


@njit(cache=True, nogil=True, error_model="numpy")
def exp2(x):
    """Return 2**x to 4e-7 relative, for x up to 127; 2**-126 for any x below."""
    y = maximum(x, f32(-126))
    z = y + ROUNDING
    r = y - (z - ROUNDING)
    r2 = r * r
    p = f32(0.0013276472) * r + f32(0.0096755410)
    p = p * r2 + (f32(0.055507131) * r + f32(0.24022120))
    p = p * r2 + (f32(0.69314694) * r + f32(1.0000001))
    # the nearest whole number stands in the last bits of z: raise the exponent by it
    return as_f32(as_i32(p) + (as_i32(z) << i32(23)))


@njit(cache=True, nogil=True, error_model="numpy")
def log2(x):
    """Return log2(x) to 1e-6 for positive normal x; -127 for zero."""
    bits = as_i32(x)
    # brings the mantissa to sqrt(1/2)..sqrt(2)
    e = (bits - i32(0x3F3504F3)) >> i32(23)
    t = as_f32(bits - (e << i32(23))) - f32(1)
    t2 = t * t
    a = f32(-0.14599063) * t + f32(0.23674604)
    b = f32(-0.24992366) * t + f32(0.28672734)
    c = f32(-0.36010382) * t + f32(0.48093846)
    d = f32(-0.72135663) * t + f32(1.4426948)
    return to_f32(e) + t * ((a * t2 + b) * (t2 * t2) + (c * t2 + d))


@njit(cache=True, nogil=True, error_model="numpy")
def contrast_row(
    line: Floats,
    pitch: int,
    first: int,
    last: int,
    vignette: Floats,
    start: int,
    stray: np.float32,
    contrast: np.float32,
    pivot_log2: np.float32,
) -> None:
    """Apply the vignette, add stray light, and raise to the power of contrast.

    start: flat index of the row in `vignette`. The power is about a level that stays.
    """
    # the power beyond one is small, and so are its errors
    extra = contrast - f32(1)
    for c in range(3):
        for x in range(first, last, W):
            dim = load(vignette, start + x, W)
            value = load(line, c * pitch + x, W) * dim + stray
            value = value * exp2(extra * log2(value) + pivot_log2)
            store(line, c * pitch + x, value)


@njit(cache=True, nogil=True, error_model="numpy")
def bend(value, knee, above):
    """Approach one above the knee, so slowly that bright walls keep their shading."""
    over = maximum(value - knee, f32(0))
    return select(value > knee, knee + above * over / (above + over), value)


@njit(cache=True, nogil=True, error_model="numpy")
def colour_row(
    line: Floats,
    pitch: int,
    first: int,
    last: int,
    saturation: np.float32,
    knee: np.float32,
    keep: np.float32,
) -> None:
    """Move colours away from their grey, and bend highlights below one.

    A share of the bend acts on the largest channel and keeps the hue, the rest on each
    channel and goes to white. The share is `keep` for a colour whose least channel is
    at most half of its largest, and falls to none for white: walls stay red, and the
    glints of a white lamp white.
    """
    above = f32(1) - knee
    for x in range(first, last, W):
        r = load(line, x, W)
        g = load(line, pitch + x, W)
        b = load(line, 2 * pitch + x, W)
        grey = f32(0.2126) * r + f32(0.7152) * g + f32(0.0722) * b
        r = maximum(grey + saturation * (r - grey), f32(0))
        g = maximum(grey + saturation * (g - grey), f32(0))
        b = maximum(grey + saturation * (b - grey), f32(0))
        store(line, x, r)
        store(line, pitch + x, g)
        store(line, 2 * pitch + x, b)
        top = maximum(r, maximum(g, b))
        if any_(top > knee):
            inverse = f32(1) / maximum(top, f32(1e-6))
            least = minimum(r, minimum(g, b))
            share = keep * minimum(f32(2) * (top - least) * inverse, f32(1))
            free = f32(1) - share
            hue = share * bend(top, knee, above) * inverse
            for c in range(3):
                value = load(line, c * pitch + x, W)
                bent = hue * value + free * bend(value, knee, above)
                store(line, c * pitch + x, select(top > knee, bent, value))


@njit(cache=True, nogil=True, error_model="numpy")
def encode_row(
    line: Floats,
    pitch: int,
    first: int,
    last: int,
    grain: Floats,
    row: int,
    shift: int,
    noise2: np.float32,
    noise_floor: np.float32,
    stop: Floats,
    start: int,
    codes: Bytes,
) -> None:
    """Add grain whose variance grows with light, apply the stop, encode as sRGB.

    The grain of the row's value x is in column ``x + shift`` of `row`, periodically;
    each row of `grain` is longer by a vector than its period. start: flat index of
    the row in `stop`. codes: (3, pitch).
    """
    side = grain.shape[1]
    for c in range(3):
        tile = (c * side + row) * grain.shape[2]
        for x in range(first, last, W):
            value = load(line, c * pitch + x, W)
            speck = load(grain, tile + (x + shift) % side, W)
            value = value + speck * sqrt(noise2 * (noise_floor + value))
            value = value * load(stop, start + x, W)
            v = minimum(maximum(value, f32(0)), f32(1))
            # 255 (1.055 v^(1/2.4) - 0.055) + 0.5, and 255 * 12.92 v + 0.5
            high = f32(269.025) * exp2(f32(1 / 2.4) * log2(v)) - f32(13.525)
            code = select(v > f32(0.0031308), high, f32(3294.6) * v + f32(0.5))
            store(codes, c * pitch + x, to_i32(code))
