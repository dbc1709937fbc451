"""Sheets of depth composited, a square of sixteen pixels at a time.

The optical depths of splats within one layer of distance are summed before the layer is
blended, so that their overlaps leave no ripple.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.bin_splats import deal_splats
from renderers.fsr.kernels.project_splats import absorbed
from renderers.fsr.kernels.tile_buffer import DARK
from renderers.fsr.splats.gaussian_falloff import BEND, EDGE, LIFT, REST, SHIFT
from renderers.fsr.splats.splat_tiles import SIDE, SQUARE, SQUARES, STATE
from renderers.lanes import (
    any_,
    f32,
    fma,
    full,
    lanes,
    load,
    lowest,
    maximum,
    minimum,
    select,
    spread,
    store,
)

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Real = float | np.float32

_NO_POINTS: Any = np.bool_(False)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def footprint(records: F32, o: int, u: Any, v: Any) -> Any:
    """Weigh pixels: zero from the cut on; `WEIGHT` times this is one at the centre."""
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
def _end_sheet(
    k: int, sums: F32, cut: Real, with_depth: bool, state: F32, depths: F32, far: F32
) -> bool:
    """Blend a square's sheet as one layer; say whether light is left."""
    at = k * STATE
    tau = load(sums, at, SQUARE)
    before = load(state, at, SQUARE)
    share = before * absorbed(tau)
    after = before - share + np.float32(DARK)
    scale = share / maximum(tau, np.float32(1e-30))
    store(state, at, after)
    for c in range(at + SQUARE, at + STATE, SQUARE):
        store(state, c, fma(scale, load(sums, c, SQUARE), load(state, c, SQUARE)))
    if with_depth:
        fallen = (before > _HALF) & (after <= _HALF)
        old = load(depths, k * SQUARE, SQUARE)
        store(depths, k * SQUARE, select(fallen, far[k], old))
    bright: bool = any_(after > cut)
    return bright


@njit(cache=True, nogil=True, error_model="numpy")
def sum_sheets(
    records: F32, boxes: I32, items: I32, left: int, top: int, sheets_of: F32,
    cut: Real, limits: F32, with_depth: bool, deal: Any,
    sums: F32, sheets: I32, far: F32, state: F32, depths: F32, alive: Any,
) -> Any:  # fmt: skip
    """Blend a tile's splats sheet by sheet; give the live squares and fragments."""
    low, scale, thickness = sheets_of[0], sheets_of[1], sheets_of[2]
    sums[:] = 0
    sheets[:] = -1
    words, offsets, shares, sheet_of, _ = deal
    limited = limits.size > 0
    one = np.int64(1)
    zero = full(_ZERO, SQUARE)
    fragments = 0
    first: Any = np.int64(0)
    while first < items.shape[0] and alive != 0:
        touched, halves, first = deal_splats(
            records, boxes, items, first, left, top, alive, _NO_POINTS, sheets_of, deal
        )
        while touched != 0:
            k = lowest(touched)
            touched &= touched - one
            at = k * STATE
            depth = load(sums, at, SQUARE)
            red = load(sums, at + SQUARE, SQUARE)
            green = load(sums, at + 2 * SQUARE, SQUARE)
            blue = load(sums, at + 3 * SQUARE, SQUARE)
            bound = load(limits, k * SQUARE, SQUARE) if limited else depth
            u = f32((lanes(SQUARE) & 3) + np.int32(left + (k & 7) * SIDE)) + _HALF
            v = f32((lanes(SQUARE) >> 2) + np.int32(top + (k >> 3) * SIDE)) + _HALF
            last = np.float32(sheets[k])
            half = 0
            those = words[k]
            while True:
                if those == 0:
                    half += 1
                    if half == halves:
                        break
                    those = words[half * SQUARES + k]
                    continue
                m = half * SQUARES + lowest(those)
                those &= those - one
                o = offsets[m]
                sheet = sheet_of[m]
                if sheet != last:
                    store(sums, at, depth)
                    store(sums, at + SQUARE, red)
                    store(sums, at + 2 * SQUARE, green)
                    store(sums, at + 3 * SQUARE, blue)
                    bright = _end_sheet(k, sums, cut, with_depth, state, depths, far)
                    depth = zero
                    red = zero
                    green = zero
                    blue = zero
                    last = sheet
                    far[k] = low + (sheet + _HALF) * thickness / scale
                    if not bright:
                        alive &= ~(one << k)
                        break
                fragments += shares[m]
                w = footprint(records, o, u, v) * spread(records, o + 5, SQUARE)
                if limited:
                    w = select(bound > spread(records, o + 6, SQUARE), w, _ZERO)
                depth = depth + w
                red = fma(w, spread(records, o + 8, SQUARE), red)
                green = fma(w, spread(records, o + 9, SQUARE), green)
                blue = fma(w, spread(records, o + 10, SQUARE), blue)
            sheets[k] = np.int32(last)
            store(sums, at, depth)
            store(sums, at + SQUARE, red)
            store(sums, at + 2 * SQUARE, green)
            store(sums, at + 3 * SQUARE, blue)
    for k in range(SQUARES):
        if sheets[k] < 0:
            continue
        if not _end_sheet(k, sums, cut, with_depth, state, depths, far):
            alive &= ~(one << k)
    return alive, fragments
