"""Compiled: exposed planes become the picture, in one sweep over the rows.

Rows are made when a later stage needs them and kept in rings just long enough, so that
everything between exposure and picture stays in the processor's cache. What is far out
of focus is blurred twice only where it is seen.
"""
# Vectors are types of the compiler alone, which functions that take them cannot name.
# mypy: disable-error-code="no-untyped-def"

from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.shading.kernels.camera_bloom import bloom_row
from renderers.shading.kernels.camera_blur import (
    across,
    blur_across,
    blur_along,
    find_rows,
)
from renderers.shading.kernels.camera_expose import Planes, clear_row, extend_row
from renderers.shading.kernels.camera_tone import colour_row, contrast_row, encode_row
from renderers.simd import absolute, any_, full, load, maximum, minimum, store
from renderers.simd.arrays import Bytes, Floats, Longs, f32

Count = int | np.int64
W = 32
ZERO, ONE = np.int64(0), np.int64(1)
"""Helpers would be compiled apart for a number that is written out."""

# columns of the tone parameters
(
    FOCUS, DEFOCUS, SOFT, SOFTER, STRAY, CONTRAST, PIVOT_LOG2, SATURATION, KNEE,
    KEEP_HUE, NOISE2, NOISE_FLOOR, GLARE, HALO,
) = range(14)  # fmt: skip


class SweepTables(NamedTuple):
    """What the sweep does to every picture of one size.

    vignette, stop: ``(rows, pitch)``, margins included. spans: ``(rows, 4)`` first and
    last pixel the stop lets through, and the same of all that these need of the row;
    whole vectors. grain: three periodic squares, their first W columns again after each
    row. tone: see the columns above. soft_taps, rest_taps, halo_taps: Gaussians; the
    second has `spacing` pixels between its taps.
    """

    vignette: Floats
    stop: Floats
    spans: Longs
    grain: Floats
    tone: Floats
    soft_taps: Floats
    rest_taps: Floats
    spacing: int
    halo_taps: Floats


class SweepRows(NamedTuple):
    """The scratch rows of one thread.

    work: rows of planes for the rings of sharp, soft-along, soft and softer-along rows.
    small: see `bloom_row`. glow: two rows of bloom and one of scratch, each with four
    vectors to spare. line: ``(5, pitch)``. codes: a row of planes of bytes.
    """

    work: Floats
    small: Floats
    glow: Floats
    line: Floats
    codes: Bytes


@njit(cache=True, nogil=True, error_model="numpy")
def add_bloom(
    exposed: Floats,
    at: int,
    glow: Floats,
    upper: int,
    lower: int,
    part: np.float32,
    sharp: Floats,
    to: int,
    size: int,
) -> None:
    """Copy a row of planes, plus what lies `part` of the way between two of `glow`."""
    for i in range(0, size, W):
        above = load(glow, upper + i, W)
        light = above + part * (load(glow, lower + i, W) - above)
        store(sharp, to + i, load(exposed, at + i, W) + light)


@njit(cache=True, nogil=True, error_model="numpy")
def copy_row(exposed: Floats, at: int, sharp: Floats, to: Count, size: int) -> None:
    """Copy a row of planes."""
    for i in range(0, size, W):
        store(sharp, to + i, load(exposed, at + i, W))


@njit(cache=True, nogil=True, error_model="numpy")
def copy_depth(depth: Floats, y: int, line: Floats, margin: int) -> None:
    """Copy a row of depth to row 3 of `line`: its last vector overruns the pixels."""
    source = depth[y]
    into = line[3, margin : margin + source.shape[0]]
    for x in range(source.shape[0]):
        into[x] = source[x]


@njit(cache=True, nogil=True, error_model="numpy")
def write_row(
    codes: Bytes,
    margin: int,
    first: int,
    last: int,
    picture: Bytes,
    y: int,
) -> None:
    """Write pixels `first` to `last` of a row from planes of bytes, black the rest."""
    width = picture.shape[1]
    past = min(last, width)
    row = picture[y].reshape(-1)
    for x in range(3 * first):
        row[x] = np.uint8(0)
    rest = row[3 * past :]
    for x in range(rest.shape[0]):
        rest[x] = np.uint8(0)
    seen = row[3 * first : 3 * past]
    red = codes[0, margin + first : margin + past]
    green = codes[1, margin + first : margin + past]
    blue = codes[2, margin + first : margin + past]
    for x in range(past - first):
        seen[3 * x] = red[x]
        seen[3 * x + 1] = green[x]
        seen[3 * x + 2] = blue[x]


@njit(cache=True, nogil=True, error_model="numpy")
def defocus_weights(depth, tone):
    """Return the shares of the sharp, soft and softer picture at a depth."""
    smallest = tone[SOFT]
    out_of = absolute(tone[FOCUS] - f32(6) / maximum(depth, f32(0.05)))
    radius = tone[DEFOCUS] * maximum(out_of - f32(0.12), f32(0))
    near = maximum(f32(1) - radius * (f32(1) / smallest), f32(0))
    spread = f32(1) / (tone[SOFTER] - smallest)
    far = minimum(maximum((radius - smallest) * spread, f32(0)), f32(1))
    return near, f32(1) - near - far, far


@njit(cache=True, nogil=True, error_model="numpy")
def mix_soft(
    work: Floats,
    sharp: int,
    soft: int,
    tone: Floats,
    pitch: int,
    first: int,
    last: int,
    line: Floats,
) -> bool:
    """Mix the sharp and the soft row by depth; tell whether the softer is wanted too.

    line: rows 0 to 2 become the colours, row 3 is the depth, row 4 the share of the
    softer.
    """
    most = full(f32(0), W)
    for x in range(first, last, W):
        depth = load(line, 3 * pitch + x, W)
        near, middle, far = defocus_weights(depth, tone)
        most = maximum(most, far)
        store(line, 4 * pitch + x, far)
        for c in range(0, 3 * pitch, pitch):
            value = load(work, sharp + c + x, W) * near
            store(line, c + x, value + load(work, soft + c + x, W) * middle)
    wanted: bool = any_(most > f32(0))
    return wanted


@njit(cache=True, nogil=True, error_model="numpy")
def add_softer(
    work: Floats,
    places: Longs,
    taps: Floats,
    pitch: int,
    first: int,
    last: int,
    line: Floats,
) -> None:
    """Add the share of the softer row, blurred across where there is any."""
    for x in range(first, last, W):
        far = load(line, 4 * pitch + x, W)
        if any_(far > f32(0)):
            for c in range(0, 3 * pitch, pitch):
                value = far * across(work, places, taps, c + x)
                store(line, c + x, load(line, c + x, W) + value)


@njit(cache=True, nogil=True, error_model="numpy")
def sweep_rows(
    planes: Planes,
    depth: Floats,
    tables: SweepTables,
    grain_row: int,
    grain_column: int,
    rows: SweepRows,
    picture: Bytes,
    first: int,
    last: int,
) -> None:
    """Bloom, blend focus by depth, vignette, tone, grain, stop, encode as sRGB."""
    exposed, _, is_lit, margin, _ = planes
    vignette, stop, spans, grain, tone, soft_taps, rest_taps, spacing, halo_taps = (
        tables
    )
    work, small, glow, line, codes = rows
    height, width = depth.shape
    size = exposed.shape[1]
    pitch = size // 3
    glow_size = glow.shape[1]
    small_rows = is_lit.shape[0]
    has_defocus = tone[DEFOCUS] > f32(0)
    soft_reach = soft_taps.shape[0] - 1
    rest_reach = (rest_taps.shape[0] - 1) * spacing
    sharp_ring = soft_reach + rest_reach + 1
    along_ring = 2 * soft_reach + 1
    rest_ring = 2 * rest_reach + 1
    along_start = sharp_ring * size
    soft_start = along_start + along_ring * size
    softer_start = soft_start + rest_ring * size
    soft_places = np.empty((soft_taps.shape[0], 2), np.int64)
    rest_places = np.empty((rest_taps.shape[0], 2), np.int64)
    halo_places = np.empty((halo_taps.shape[0], 2), np.int64)
    softer_rows = np.full(rest_ring, -1, np.int64)
    has_glow = np.zeros(2, np.bool_)
    glow_next = ZERO
    glare_known = ZERO
    sharp_next = max(first - soft_reach - rest_reach, 0)
    soft_first = max(first - rest_reach, 0)
    for y in range(first, last):
        while sharp_next <= y + soft_reach + rest_reach:
            if sharp_next < height:
                n = sharp_next
                to = n % sharp_ring * size
                at = min(
                    max(f32(n) * f32(0.25) - f32(0.375), f32(0)), f32(small_rows - 1)
                )
                upper = min(int(at), small_rows - 2)
                glow_next = max(glow_next, upper)
                while glow_next <= upper + 1:
                    has_glow[glow_next % 2] = bloom_row(
                        planes, glow_next, glare_known, halo_taps, tone[GLARE],
                        tone[HALO], small, halo_places, width, glow,
                        glow_next % 2 * glow_size, 2 * glow_size,
                    )  # fmt: skip
                    if not has_glow[glow_next % 2]:
                        clear_row(glow, glow_next % 2 * glow_size, size)
                    glare_known = min(glow_next + halo_taps.shape[0], small_rows)
                    glow_next += 1
                if has_glow[0] or has_glow[1]:
                    add_bloom(
                        exposed, n * size, glow, upper % 2 * glow_size,
                        (upper + 1) % 2 * glow_size, at - f32(upper), work, to, size,
                    )  # fmt: skip
                else:
                    copy_row(exposed, n * size, work, to, size)
                if has_defocus:
                    into = along_start + n % along_ring * size
                    blur_along(
                        work, to, soft_taps, ONE, work, into, pitch, spans[n, 2],
                        spans[n, 3],
                    )  # fmt: skip
            n = sharp_next - soft_reach
            if has_defocus and soft_first <= n < height:
                find_rows(n, height, ONE, along_start, along_ring, size, soft_places)
                to = soft_start + n % rest_ring * size
                blur_across(
                    work, soft_places, soft_taps, work, to, pitch, spans[n, 2],
                    spans[n, 3],
                )  # fmt: skip
                extend_row(work, to, pitch, margin, width)
            sharp_next += 1
        begin, end = spans[y, 0], spans[y, 1]
        sharp = y % sharp_ring * size
        if has_defocus:
            copy_depth(depth, y, line, margin)
            soft = soft_start + y % rest_ring * size
            if mix_soft(work, sharp, soft, tone, pitch, begin, end, line):
                for k in range(1 - rest_taps.shape[0], rest_taps.shape[0]):
                    n = min(max(y + k * spacing, 0), height - 1)
                    slot = n % rest_ring
                    if softer_rows[slot] != n:
                        softer_rows[slot] = n
                        at = soft_start + slot * size
                        to = softer_start + slot * size
                        blur_along(
                            work, at, rest_taps, spacing, work, to, pitch,
                            spans[n, 2], spans[n, 3],
                        )  # fmt: skip
                find_rows(
                    y, height, spacing, softer_start, rest_ring, size, rest_places
                )
                add_softer(work, rest_places, rest_taps, pitch, begin, end, line)
        else:
            copy_row(work, sharp, line, ZERO, size)
        table = y * pitch
        contrast_row(
            line, pitch, begin, end, vignette, table, tone[STRAY], tone[CONTRAST],
            tone[PIVOT_LOG2],
        )  # fmt: skip
        colour_row(
            line, pitch, begin, end, tone[SATURATION], tone[KNEE], tone[KEEP_HUE]
        )
        encode_row(
            line, pitch, begin, end, grain, (y + grain_row) % grain.shape[1],
            grain_column - margin + grain.shape[1], tone[NOISE2], tone[NOISE_FLOOR],
            stop, table, codes,
        )  # fmt: skip
        write_row(codes, margin, begin - margin, end - margin, picture, y)
