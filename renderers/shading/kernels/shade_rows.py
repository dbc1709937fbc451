"""Compiled: shade rows of a G-buffer.

Pixels are worked on in blocks of 64, stage by stage, 16 at a time. Each quantity of a
block lies in its own stretch of one scratch array. What a pixel gets does not depend
on the block it is in, so that the bits do not depend on how rows are dealt out.
Positions are millimetres from the eye along world axes.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

import renderers.shading.kernels.pixel_block as block
from renderers.shading.kernels.direct_light import light
from renderers.shading.kernels.elementary import along_axes, rotated
from renderers.shading.kernels.field_reads import DistanceField
from renderers.shading.kernels.follow_rays import BufferView
from renderers.shading.kernels.path_tracing import FibreLight
from renderers.shading.kernels.pixel_block import CELL, ROWS, SLOTS, N, W
from renderers.shading.kernels.pushed_block import bring_to_rest, show_again
from renderers.shading.kernels.shadow import darken
from renderers.shading.kernels.tissue_surface import (
    SurfaceTables,
    find_surface,
    set_materials,
    set_tissue,
)
from renderers.shading.kernels.virtual_lights import PLANES, lift, spread_grid
from renderers.shading.kernels.wound_marks import (
    WoundField,
    find_wounds,
    hides_surface,
    mark_wounds,
)
from renderers.simd import (
    any_,
    lanes,
    load,
    load_where,
    maximum,
    minimum,
    select,
    store,
    store_where,
    unzip3,
    zip3,
)
from renderers.simd.arrays import Floats, Longs, f32, i32
from renderers.simd.atomics import fetch_add

TURN_ROWS = 2 * CELL
"""Rows of the picture that a thread shades at a time."""


class Shadows(NamedTuple):
    """What casts shadows, and how far a source reaches; see `light`."""

    arcs: Floats
    capsules: Floats


class Bounced(NamedTuple):
    """Light by way of other walls: a grid of `VirtualLights.gather`, and its factor."""

    grid: Floats
    factor: np.float32


@njit(cache=True, nogil=True, error_model="numpy")
def shown_span(
    depth: Floats, coverage: Floats, first: int, last: int
) -> tuple[int, int]:
    """Return the columns between which rows ``first..last`` show anything, by W."""
    width = depth.shape[1]
    start = width
    end = 0
    for y in range(first, last):
        for x in range(0, width, W):
            inside = lanes(W) < i32(width - x)
            t = load_where(depth, y * width + x, inside)
            cover = load_where(coverage, y * width + x, inside)
            if any_((cover > f32(0)) & (t < f32(1e6))):
                start = min(start, x)
                end = max(end, x + W)
    return start, end


@njit(cache=True, nogil=True, error_model="numpy")
def fetch(
    w: Floats,
    depth: Floats,
    normal: Floats,
    coverage: Floats,
    lens: Floats,
    axes: Floats,
    to_voxel: Floats,
    eye: Floats,
    pixel: np.float32,
    y0: int,
    x0: int,
    rows: tuple[int, int],
) -> None:
    """Place a block: rays, points, voxels, footprints.

    rows: first and past the last. What shows nothing, or lies outside them, gets
    coverage 0.
    """
    width = depth.shape[1]
    here = lanes(W)
    first, last = rows
    for i in range(0, N, W):
        y = y0 + i // W
        at = y * width + x0
        left = width - x0 if first <= y < last else 0
        inside = here < i32(left)
        cover = load_where(coverage, at, inside)
        t = load_where(depth, at, inside)
        shown = (cover > f32(0)) & (t < f32(1e6))
        t = select(shown, maximum(t, f32(1e-3)), f32(1))
        store(w, block.COVER + i, select(shown, cover, f32(0)))
        store(w, block.T + i, t)
        # the three parts of a run of triples, none beyond the end of the row
        second = here < i32(3 * left - W)
        third = here < i32(3 * left - 2 * W)
        a, b, c = unzip3(
            load_where(lens, 3 * at, here < i32(3 * left)),
            load_where(lens, 3 * at + W, second),
            load_where(lens, 3 * at + 2 * W, third),
        )
        dx, dy, dz = along_axes(axes, a, b, c)
        nx, ny, nz = unzip3(
            load_where(normal, 3 * at, here < i32(3 * left)),
            load_where(normal, 3 * at + W, second),
            load_where(normal, 3 * at + 2 * W, third),
        )
        facing = -(nx * dx + ny * dy + nz * dz)
        store(w, block.FOOT + i, t * pixel / maximum(facing, f32(0.12)))
        store(w, block.DX + i, dx)
        store(w, block.DY + i, dy)
        store(w, block.DZ + i, dz)
        store(w, block.NX + i, nx)
        store(w, block.NY + i, ny)
        store(w, block.NZ + i, nz)
        dx *= t
        dy *= t
        dz *= t
        store(w, block.PX + i, dx)
        store(w, block.PY + i, dy)
        store(w, block.PZ + i, dz)
        ux, uy, uz = rotated(to_voxel, dx, dy, dz)
        store(w, block.UX + i, eye[0] + ux)
        store(w, block.UY + i, eye[1] + uy)
        store(w, block.UZ + i, eye[2] + uz)


@njit(cache=True, nogil=True, error_model="numpy")
def shade_rows(
    view: BufferView,
    field: DistanceField,
    eye_mm: Floats,
    pixel: np.float32,
    beam: FibreLight,
    shadows: Shadows,
    bounced_light: Bounced,
    surface: SurfaceTables,
    wounds: WoundField,
    lit: bool,
    radiance: Floats,
    turns: Longs,
) -> None:
    """Write linear radiance ``(h, w, 3)`` of the rows whose turns this thread gets.

    turns: one number that all threads share, of runs of `TURN_ROWS` rows. lit: else
    write what a surface sends back of diffuse light, its albedo less what its film
    mirrors, times coverage. eye_mm: the eye seen from the volume's centre. pixel: its
    radians. wounds: none where its cubes are empty; with what is pushed.
    """
    depth, normal, coverage, material, lens, axes = view
    distance, to_voxel, eye_voxel = field
    sources, forward, spread, each = beam
    arcs, capsules = shadows
    grid, bounce = bounced_light
    materials = surface.materials
    width = depth.shape[1]
    scratch = np.zeros(SLOTS + W, np.float32)
    # a vector that straddles two lines of the cache costs twice
    w = scratch[-(scratch.ctypes.data // 4) % W :]
    mixed = False
    set_tissue(w, materials)
    bounced = np.zeros((2, PLANES, width + W + CELL), np.float32)
    height = depth.shape[0]
    while True:
        first = fetch_add(turns) * TURN_ROWS
        if first >= height:
            return
        last = min(first + TURN_ROWS, height)
        for y0 in range(first, last, ROWS):
            if y0 % CELL == 0:
                spread_grid(grid, y0 // CELL, bounced)
            high = min(y0 + ROWS, last)
            radiance[y0:high] = f32(0)
            start, end = shown_span(depth, coverage, y0, high)
            for x0 in range(start, end, W):
                fetch(
                    w, depth, normal, coverage, lens, axes, to_voxel, eye_voxel, pixel,
                    y0, x0, (first, last),
                )  # fmt: skip
                if not any_(load(w, block.COVER, N) > f32(0)):
                    continue
                mixed = set_materials(
                    w, material, y0, x0, first, last, materials, mixed
                )
                if lit:
                    # its grid is at hand while the surface's memory is not
                    lift(w, bounced, y0, x0)
                moved = bring_to_rest(w, wounds.pushed, to_voxel)
                kinds = 0
                if wounds.cubes.size:
                    shown = block.SHOWN_UX if moved else block.UX
                    kinds = find_wounds(w, field, wounds, shown)
                if not hides_surface(w, kinds):
                    find_surface(w, mixed, surface, distance.shape, eye_mm)
                if kinds:
                    mark_wounds(w, eye_mm, wounds, surface.tile, materials, kinds)
                if moved:
                    show_again(w)
                if lit:
                    light(w, sources, arcs, capsules, forward, spread, each)
                    if capsules.shape[0]:
                        darken(w, capsules)
                    finish(w, bounce)
                else:
                    bare(w)
                put(w, radiance, y0, x0, first, last)


@njit(cache=True, nogil=True, error_model="numpy")
def finish(w: Floats, bounce: np.float32) -> None:
    """Join direct, bounced and mirrored light; leave rgb in three slots."""
    # what wraps round an edge is missing elsewhere; one division for two wraps
    red = f32(1) + minimum(f32(0.25) * load(w, block.LR, N), f32(0.35))
    green = f32(1) + minimum(f32(0.25) * load(w, block.LG, N), f32(0.2))
    k = f32(1) / (red * green)
    direct = green * k
    direct_red = load(w, block.E_RED, N) * (direct * direct)
    direct = red * k
    direct = load(w, block.E_GREEN, N) * (direct * direct)
    # the reflected light's own albedo, and further bounces as a series;
    # one division for the three channels
    red = load(w, block.RED, N)
    green = load(w, block.GREEN, N)
    blue = load(w, block.BLUE, N)
    r = f32(1) - f32(0.6) * red
    g = f32(1) - f32(0.6) * green
    b = f32(1) - f32(0.6) * blue
    gb = g * b
    e = bounce * load(w, block.BOUNCE, N) / (r * gb)
    r, g, b = e * gb, e * (r * b), e * (r * g)
    wet = f32(1) - f32(0.7) * load(w, block.SKIN, N)
    spark = load(w, block.SPARK, N) * wet * f32(0.5 / math.pi)
    cover = load(w, block.COVER, N)
    k = (f32(1) - load(w, block.F0, N)) * f32(1 / math.pi)
    store(w, block.E_RED, cover * (k * (red * (direct_red + red * r)) + spark))
    store(w, block.E_GREEN, cover * (k * (green * (direct + green * g)) + spark))
    store(w, block.BOUNCE, cover * (k * (blue * (direct + blue * b)) + spark))


@njit(cache=True, nogil=True, error_model="numpy")
def bare(w: Floats) -> None:
    """Leave the diffuse share of a block's reflection in the three slots of rgb."""
    k = load(w, block.COVER, N) * (f32(1) - load(w, block.F0, N))
    store(w, block.E_RED, k * load(w, block.RED, N))
    store(w, block.E_GREEN, k * load(w, block.GREEN, N))
    store(w, block.BOUNCE, k * load(w, block.BLUE, N))


@njit(cache=True, nogil=True, error_model="numpy")
def put(w: Floats, radiance: Floats, y0: int, x0: int, first: int, last: int) -> None:
    """Write a finished block into rows ``first..last`` of the picture."""
    width = radiance.shape[1]
    left = 3 * (width - x0)
    here = lanes(W)
    for y in range(max(y0, first), min(y0 + ROWS, last)):
        i = (y - y0) * W
        at = 3 * (y * width + x0)
        a, b, c = zip3(
            load(w, block.E_RED + i, W),
            load(w, block.E_GREEN + i, W),
            load(w, block.BOUNCE + i, W),
        )
        store_where(radiance, at, a, here < i32(left))
        store_where(radiance, at + W, b, here < i32(left - W))
        store_where(radiance, at + 2 * W, c, here < i32(left - 2 * W))
