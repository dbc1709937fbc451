"""Compiled: optics, tone and noise of the camera, row by row.

Colour planes stay interleaved; a row is then 3 w floats, and a blur along it steps by
three. Finishing works on blocks of 64 pixels in one scratch array with constant
offsets, which lets the compiler use vector code (see the surface block).
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

f32 = np.float32
i32 = np.int32
Floats = NDArray[np.float32]

N = 64
R, G, B = 0, N, 2 * N
GRAIN, NEAR, MIDDLE, FAR = 3 * N, 6 * N, 7 * N, 8 * N
SLOTS = 9 * N

# columns of the tone parameters
(
    FOCUS, DEFOCUS, SOFT, SOFTER, STRAY, CONTRAST, PIVOT_LOG2, SATURATION, KNEE,
    KEEP_HUE, NOISE2, NOISE_FLOOR,
) = range(12)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def exp2(x: np.float32) -> np.float32:
    """Give 2**x to 2e-7 relative, for x in -126..127, without a call."""
    y = min(max(x, f32(-126)), f32(127))
    # the shift may round k up or down, but what is left of y is exact
    k = i32(y + f32(127))
    r = y - f32(k - i32(127))
    p = f32(1.8775767e-3)
    p = p * r + f32(8.9893397e-3)
    p = p * r + f32(5.5826318e-2)
    p = p * r + f32(2.4015361e-1)
    p = p * r + f32(6.9315308e-1)
    p = p * r + f32(0.99999994)
    return p * i32(k << i32(23)).view(np.float32)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def log2(x: np.float32) -> np.float32:
    """Give log2(x) to 1e-6 for positive normal x; about -127 for zero.

    The mantissa is brought to sqrt(1/2)..sqrt(2); with s = (m - 1) / (m + 1), log m
    is the odd series 2 (s + s^3/3 + s^5/5 + s^7/7).
    """
    bits = f32(x).view(np.int32)
    shifted = i32(bits - i32(0x3F3504F3))
    e = i32(shifted >> i32(23))
    m = i32(bits - i32(e << i32(23))).view(np.float32)
    s = (m - f32(1)) / (m + f32(1))
    s2 = s * s
    p = f32(0.41219858) * s2 + f32(0.57707802)
    p = p * s2 + f32(0.96179669)
    p = p * s2 + f32(2.8853901)
    return f32(e) + s * p


@njit(cache=True, nogil=True, error_model="numpy")
def expose_rows(
    radiance: Floats,
    gain: np.float32,
    red_column: NDArray[np.int32],
    red_part: Floats,
    blue_column: NDArray[np.int32],
    blue_part: Floats,
    red_row: NDArray[np.int32],
    red_row_part: Floats,
    blue_row: NDArray[np.int32],
    blue_row_part: Floats,
    exposed: Floats,
    first: int,
    last: int,
) -> None:
    """Apply gain, and lateral colour: red a little larger, blue a little smaller.

    A channel's pixel x is read between source columns ``column[x]`` and the next, at
    ``part[x]``; rows alike.
    """
    width = radiance.shape[1]
    three = np.uint64(3)
    for y in range(first, last):
        into = exposed[y].reshape(-1)
        level = radiance[y].reshape(-1)
        for x in range(width):
            into[3 * x + 1] = gain * level[3 * x + 1]
        upper = radiance[red_row[y]].reshape(-1)
        lower = radiance[red_row[y] + 1].reshape(-1)
        q = gain * red_row_part[y]
        p = gain - q
        for x in range(width):
            c = three * np.uint64(red_column[x])
            a = p * upper[c] + q * lower[c]
            b = p * upper[c + three] + q * lower[c + three]
            into[3 * x] = a + red_part[x] * (b - a)
        upper = radiance[blue_row[y]].reshape(-1)[2:]
        lower = radiance[blue_row[y] + 1].reshape(-1)[2:]
        q = gain * blue_row_part[y]
        p = gain - q
        for x in range(width):
            c = three * np.uint64(blue_column[x])
            a = p * upper[c] + q * lower[c]
            b = p * upper[c + three] + q * lower[c + three]
            into[3 * x + 2] = a + blue_part[x] * (b - a)


@njit(cache=True, nogil=True, error_model="numpy")
def blur_along(
    source: Floats, taps: Floats, spacing: int, blurred: Floats, first: int, last: int
) -> None:
    """Blur rows ``first..last`` along x with symmetric `taps` every `spacing` px."""
    width = source.shape[1]
    reach = (taps.shape[0] - 1) * spacing
    line = np.empty(3 * (width + 2 * reach), np.float32)
    for y in range(first, last):
        for c in range(3):
            left = source[y, 0, c]
            right = source[y, width - 1, c]
            for x in range(reach):
                line[3 * x + c] = left
                line[3 * (reach + width + x) + c] = right
        row = source[y].reshape(-1)
        into = blurred[y].reshape(-1)
        middle = line[3 * reach :]
        weight = taps[0]
        for x in range(3 * width):
            middle[x] = row[x]
        for x in range(3 * width):
            into[x] = weight * row[x]
        for k in range(1, taps.shape[0]):
            # views, so that the indices of the loop are plainly not negative
            before = line[3 * (reach - k * spacing) :]
            after = line[3 * (reach + k * spacing) :]
            weight = taps[k]
            for x in range(3 * width):
                into[x] += weight * (before[x] + after[x])


@njit(cache=True, nogil=True, error_model="numpy")
def blur_across(
    source: Floats, taps: Floats, spacing: int, blurred: Floats, first: int, last: int
) -> None:
    """Blur rows ``first..last`` along y with symmetric `taps` every `spacing` px."""
    height = source.shape[0]
    length = 3 * source.shape[1]
    for y in range(first, last):
        into = blurred[y].reshape(-1)
        row = source[y].reshape(-1)
        weight = taps[0]
        for x in range(length):
            into[x] = weight * row[x]
        for k in range(1, taps.shape[0]):
            above = source[max(y - k * spacing, 0)].reshape(-1)
            below = source[min(y + k * spacing, height - 1)].reshape(-1)
            weight = taps[k]
            for x in range(length):
                into[x] += weight * (above[x] + below[x])


@njit(cache=True, nogil=True, error_model="numpy")
def glare_rows(exposed: Floats, glare: Floats, first: int, last: int) -> None:
    """Average what exceeds white over 4 x 4 pixels, at most 3: rows of `glare`."""
    height, width = exposed.shape[:2]
    for row in range(first, last):
        for column in range(glare.shape[1]):
            r = f32(0)
            g = f32(0)
            b = f32(0)
            for y in range(4 * row, min(4 * row + 4, height)):
                for x in range(4 * column, min(4 * column + 4, width)):
                    r += min(max(exposed[y, x, 0] - f32(1), f32(0)), f32(3))
                    g += min(max(exposed[y, x, 1] - f32(1), f32(0)), f32(3))
                    b += min(max(exposed[y, x, 2] - f32(1), f32(0)), f32(3))
            glare[row, column, 0] = r * f32(1 / 16)
            glare[row, column, 1] = g * f32(1 / 16)
            glare[row, column, 2] = b * f32(1 / 16)


@njit(cache=True, nogil=True, error_model="numpy")
def add_bloom(bloom: Floats, exposed: Floats, first: int, last: int) -> None:
    """Add the quarter-size `bloom`, interpolated, to rows ``first..last``."""
    rows, columns = bloom.shape[:2]
    width = exposed.shape[1]
    line = np.empty(3 * columns, np.float32)
    for y in range(first, last):
        at = min(max((f32(y) - f32(1.5)) * f32(0.25), f32(0)), f32(rows) - f32(1))
        j = min(i32(at), i32(rows - 2))
        q = at - f32(j)
        upper = bloom[j].reshape(-1)
        lower = bloom[j + 1].reshape(-1)
        most = f32(0)
        for x in range(3 * columns):
            line[x] = upper[x] + q * (lower[x] - upper[x])
            most = max(most, line[x])
        if most <= f32(1e-5):
            continue
        into = exposed[y].reshape(-1)
        # centres of bloom pixels lie at 4 i + 1.5: before the first, after the last
        for x in range(min(2, width)):
            for c in range(3):
                into[3 * x + c] += line[c]
        for x in range(4 * columns - 2, width):
            for c in range(3):
                into[3 * x + c] += line[3 * columns - 3 + c]
        for i in range(columns - 1):
            for c in range(3):
                value = line[3 * i + c]
                step = f32(0.25) * (line[3 * i + 3 + c] - value)
                value += f32(0.5) * step
                for k in range(4):
                    x = 4 * i + 2 + k
                    if x < width:
                        into[3 * x + c] += value
                    value += step


@njit(cache=True, nogil=True, error_model="numpy")
def develop_rows(
    sharp: Floats,
    soft: Floats,
    softer: Floats,
    depth: Floats,
    vignette: Floats,
    stop: Floats,
    grain: Floats,
    grain_row: int,
    grain_column: int,
    tone: Floats,
    picture: NDArray[np.uint8],
    first: int,
    last: int,
) -> None:
    """Blend focus by depth; vignette, tone, grain, stop; encode as sRGB.

    grain: periodic rows, each followed by its first N columns again.
    """
    width = sharp.shape[1]
    side = grain.shape[0]
    w = np.zeros(SLOTS, np.float32)
    focus = tone[FOCUS]
    defocus = tone[DEFOCUS]
    smallest = tone[SOFT]
    spread = f32(1) / (tone[SOFTER] - smallest)
    stray = tone[STRAY]
    contrast = tone[CONTRAST]
    pivot = tone[PIVOT_LOG2]
    saturation = tone[SATURATION]
    most = tone[KEEP_HUE]
    noise2 = tone[NOISE2]
    noise_floor = tone[NOISE_FLOOR]
    knee = tone[KNEE]
    above = f32(1) - knee
    for y in range(first, last):
        grain_y = (y + grain_row) % side
        for x0 in range(0, width, N):
            count = min(N, width - x0)
            # flat, because the compiler must see that the stride is three
            start = 3 * (y * width + x0)
            sharp_row = sharp.reshape(-1)[start:]
            soft_row = soft.reshape(-1)[start:]
            softer_row = softer.reshape(-1)[start:]
            picture_row = picture.reshape(-1)[start:]
            start = 3 * (grain_y * (side + N) + (x0 + grain_column) % side)
            grain_part = grain.reshape(-1)[start:]
            for i in range(count):
                w[NEAR + i] = depth[y, x0 + i]
            for i in range(N):
                out_of = abs(focus - f32(6) / max(w[NEAR + i], f32(0.05)))
                radius = defocus * max(out_of - f32(0.12), f32(0))
                near = max(f32(1) - radius / smallest, f32(0))
                far = min(max((radius - smallest) * spread, f32(0)), f32(1))
                w[NEAR + i] = near
                w[FAR + i] = far
                w[MIDDLE + i] = f32(1) - near - far
            for i in range(count):
                w[R + i] = sharp_row[3 * i] * w[NEAR + i]
                w[G + i] = sharp_row[3 * i + 1] * w[NEAR + i]
                w[B + i] = sharp_row[3 * i + 2] * w[NEAR + i]
            for i in range(count):
                w[R + i] += soft_row[3 * i] * w[MIDDLE + i]
                w[G + i] += soft_row[3 * i + 1] * w[MIDDLE + i]
                w[B + i] += soft_row[3 * i + 2] * w[MIDDLE + i]
            for i in range(count):
                w[R + i] += softer_row[3 * i] * w[FAR + i]
                w[G + i] += softer_row[3 * i + 1] * w[FAR + i]
                w[B + i] += softer_row[3 * i + 2] * w[FAR + i]
            for i in range(count):
                dim = vignette[y, x0 + i]
                w[R + i] = w[R + i] * dim + stray
                w[G + i] = w[G + i] * dim + stray
                w[B + i] = w[B + i] * dim + stray
            for i in range(count):
                w[GRAIN + i] = grain_part[3 * i]
                w[GRAIN + N + i] = grain_part[3 * i + 1]
                w[GRAIN + 2 * N + i] = grain_part[3 * i + 2]
            for i in range(3 * N):
                # contrast about middle grey
                lit = exp2(contrast * log2(w[i]) + pivot)
                w[i] = lit if w[i] > f32(1e-30) else f32(0)
            for i in range(N):
                r = w[R + i]
                g = w[G + i]
                b = w[B + i]
                grey = f32(0.2126) * r + f32(0.7152) * g + f32(0.0722) * b
                r = max(grey + saturation * (r - grey), f32(0))
                g = max(grey + saturation * (g - grey), f32(0))
                b = max(grey + saturation * (b - grey), f32(0))
                # shoulder: colours keep their hue, what is nearly white goes white
                top = max(r, max(g, b))
                # it approaches one slowly: bright walls keep their shading
                over = max(top - knee, f32(0))
                bent = knee + above * over / (above + over) if top > knee else top
                least = min(r, min(g, b))
                keep = most * min(f32(2) * (top - least) / max(top, f32(1e-6)), f32(1))
                free = f32(1) - keep
                hue = keep * bent / max(top, f32(1e-6))
                over = max(r - knee, f32(0))
                q = knee + above * over / (above + over) if r > knee else r
                w[R + i] = hue * r + free * q
                over = max(g - knee, f32(0))
                q = knee + above * over / (above + over) if g > knee else g
                w[G + i] = hue * g + free * q
                over = max(b - knee, f32(0))
                q = knee + above * over / (above + over) if b > knee else b
                w[B + i] = hue * b + free * q
            for i in range(3 * N):
                w[i] += w[GRAIN + i] * math.sqrt(noise2 * (noise_floor + w[i]))
            for i in range(count):
                edge = stop[y, x0 + i]
                w[R + i] *= edge
                w[G + i] *= edge
                w[B + i] *= edge
            for i in range(3 * N):
                v = min(max(w[i], f32(0)), f32(1))
                high = f32(1.055) * exp2(f32(1 / 2.4) * log2(v)) - f32(0.055)
                v = high if v > f32(0.0031308) else f32(12.92) * v
                w[i] = f32(255) * v + f32(0.5)
            for i in range(count):
                picture_row[3 * i] = np.uint8(i32(w[R + i]))
                picture_row[3 * i + 1] = np.uint8(i32(w[G + i]))
                picture_row[3 * i + 2] = np.uint8(i32(w[B + i]))
