"""Compiled: bring what was found on a lattice of pixels to all of them.

Four pixels at a time: they lie between the same lattice points, whose spacing is a
multiple of four.
"""

import numpy as np
from numba import njit

from renderers.shading.kernels.elementary import along_axes
from renderers.shading.kernels.field_reads import to_voxels
from renderers.shading.kernels.follow_rays import (
    FILM,
    FOUND,
    METAL,
    MIRROR,
    THIN,
    TISSUE,
    BufferView,
    LitWalls,
    follow,
)
from renderers.shading.kernels.path_tracing import albedo_at, nearest_code
from renderers.simd import (
    any_,
    bits,
    full,
    gather,
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
from renderers.simd import f32 as to_real
from renderers.simd.arrays import Flags, Floats, Lanes, f32, i32

W = 4
"""Pixels worked on together; divides the lattice's spacing."""
SKIPPED = 16
"""Pixels that are looked at together whether they show more than tissue."""
NOTHING = -2
"""The number of no material."""
GROUND = f32(0.15)
"""Of what polished metal would mirror: instruments are ground matt, so as not to
dazzle. What they scatter instead is in their albedo and the width of their gloss."""
LEAST = f32(0.05)
"""A pixel with less weight on the lattice follows light of its own."""


@njit(cache=True, nogil=True, error_model="numpy")
def triples(array: Floats, at: int, count: int) -> Lanes:
    """Load x, y and z of `count` pixels, zeros after them."""
    here = lanes(W)
    return unzip3(
        load_where(array, 3 * at, here < i32(3 * count)),
        load_where(array, 3 * at + W, here < i32(3 * count - W)),
        load_where(array, 3 * at + 2 * W, here < i32(3 * count - 2 * W)),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(
    view: BufferView, stride: int, grid: Floats, y: int, x: int, kinds: Lanes, t: Lanes,
    n: tuple[Lanes, Lanes, Lanes], channels: int, found: Floats,
) -> Lanes:  # fmt: skip
    """Sum the cell's corners of a pixel's own surface; give their weight.

    n: the pixels' normals. found: sums of `W` pixels for each channel.
    """
    depth, normal, coverage, material, _, _ = view
    height, width = depth.shape
    gy, gx = y // stride, x // stride
    fy = f32(y % stride) / f32(stride)
    fx = to_real(lanes(W) + i32(x % stride)) / f32(stride)
    total = full(f32(0), W)
    for c in range(channels):
        store(found, c * W, total)
    for corner in range(4):
        right, down = corner & 1, corner >> 1
        row = min((gy + down) * stride, height - 1)
        column = min((gx + right) * stride, width - 1)
        if coverage[row, column] <= f32(0):
            continue
        apart = depth[row, column] / t - f32(1)
        same = n[0] * normal[row, column, 0] + n[1] * normal[row, column, 1]
        same = maximum(same + n[2] * normal[row, column, 2], f32(0))
        k = same * same * same * same / (f32(1) + f32(400) * apart * apart)
        k *= fx if right else f32(1) - fx
        k *= fy if down else f32(1) - fy
        k = select(kinds == i32(material[row, column]), k, f32(0))
        total += k
        for c in range(channels):
            sum_ = load(found, c * W, W)
            store(found, c * W, sum_ + k * grid[gy + down, gx + right, c])
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def add_rows(
    view: BufferView, effects: int, stride: int, walls: LitWalls, grid: Floats,
    reflect: Floats, only: Flags, radiance: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Add the light that was found to rows ``first..last`` of the picture.

    stride: a multiple of `W`. reflect: each material's reflectance at normal incidence.
    only: ``(h, w)`` pixels to add to.
    Pixels far from all lattice points of their own surface follow light of their own.
    """
    depth, normal, coverage, material, lens, axes = view
    field, _, colour, _, _ = walls
    width = depth.shape[1]
    of_metal = effects & MIRROR
    of_tissue = effects & (FILM | THIN)
    metal = i32(METAL if of_metal else NOTHING)
    tissue = i32(TISSUE if of_tissue else NOTHING)
    thin = effects & THIN
    channels = FOUND if thin else 3
    found = np.zeros(FOUND * W, np.float32)
    own = np.empty(FOUND, np.float32)
    tints = np.zeros(2 * W, np.float32)
    dry = np.empty(W, np.float32)
    kind = np.empty(W, np.int32)
    rays = np.empty(3 * W, np.float32)
    blank = False
    for y in range(first, last):
        for x in range(0, width, W):
            at = y * width + x
            if not of_tissue and x % SKIPPED == 0 and x + SKIPPED <= width:
                blank = not any_(load(material, at, SKIPPED) != TISSUE)
            elif x % SKIPPED == 0:
                blank = False
            if blank:
                continue
            count = min(W, width - x)
            for i in range(W):
                kind[i] = material[y, x + i] if i < count and only[y, x + i] else -1
            kinds = load(kind, 0, W)
            wanted = (kinds == metal) | (kinds == tissue)
            inside = lanes(W) < i32(count)
            t = load_where(depth, at, inside)
            cover = load_where(coverage, at, inside)
            wanted &= (cover > f32(0)) & (t < f32(1e6))
            if not any_(wanted):
                continue
            nx, ny, nz = triples(normal, at, count)
            a, b, c = triples(lens, at, count)
            rx, ry, rz = along_axes(axes, a, b, c)
            total = interpolate(
                view, stride, grid, y, x, kinds, t, (nx, ny, nz), channels, found
            )  # fmt: skip
            near = total > LEAST
            for n in range(channels):
                mean = load(found, n * W, W) / total
                store(found, n * W, select(near, mean, f32(0)))
            alone = bits(wanted & ~near)
            skinned = bits(wanted & (kinds == TISSUE))
            store(dry, 0, full(f32(0), W))
            if alone | skinned:
                store(rays, 0, rx)
                store(rays, W, ry)
                store(rays, 2 * W, rz)
                for i in range(count):
                    d = depth[y, x + i]
                    ray = (rays[i], rays[W + i], rays[2 * W + i])
                    place = (d * ray[0], d * ray[1], d * ray[2])
                    if (skinned >> i) & 1:
                        u, v, w = to_voxels(field, place)
                        dry[i] = f32(nearest_code(colour.skin, u, v, w))
                        if thin:
                            rho = albedo_at(colour, u, v, w)
                            tints[i], tints[W + i] = rho[0], rho[2]
                    if (alone >> i) & 1:
                        wall = (normal[y, x + i, 0], normal[y, x + i, 1],
                                normal[y, x + i, 2])  # fmt: skip
                        shows = of_metal if kind[i] == METAL else of_tissue
                        follow(place, ray, wall, shows, walls, own)
                        for n in range(channels):
                            found[n * W + i] = own[n]
            facing = minimum(maximum(-(nx * rx + ny * ry + nz * rz), f32(0)), f32(1))
            graze = f32(1) - facing
            f0 = gather(reflect, kinds, wanted)
            rest = f32(1) - f0
            mirrored = f0 + rest * graze * graze * graze * graze * graze
            mirrored = select(kinds == i32(METAL), GROUND * mirrored, mirrored)
            # dry skin hardly mirrors
            mirrored *= f32(1) - f32(0.7 / 255) * load(dry, 0, W)
            red, green, blue = triples(radiance, at, count)
            if thin:
                # what the film sparkles is the same in all three, and stays
                lit, tint = load(tints, 0, W), load(tints, W, W)
                lit = maximum(red - blue, f32(0)) / maximum(lit - tint, f32(1e-3))
                spark = minimum(minimum(red, green), blue)
                spark = minimum(maximum(blue - tint * lit, f32(0)), spark)
                thinned = wanted & (kinds == TISSUE)
                lost = (red - spark) * load(found, 6 * W, W)
                red = select(thinned, red - lost, red)
                lost = (green - spark) * load(found, 7 * W, W)
                green = select(thinned, green - lost, green)
                lost = (blue - spark) * load(found, 8 * W, W)
                blue = select(thinned, blue - lost, blue)
            more = mirrored * load(found, 0, W) + rest * load(found, 3 * W, W)
            red = select(wanted, maximum(red + cover * more, f32(0)), red)
            more = mirrored * load(found, W, W) + rest * load(found, 4 * W, W)
            green = select(wanted, maximum(green + cover * more, f32(0)), green)
            more = mirrored * load(found, 2 * W, W) + rest * load(found, 5 * W, W)
            blue = select(wanted, maximum(blue + cover * more, f32(0)), blue)
            p, q, r = zip3(red, green, blue)
            here = lanes(W)
            store_where(radiance, 3 * at, p, here < i32(3 * count))
            store_where(radiance, 3 * at + W, q, here < i32(3 * count - W))
            store_where(radiance, 3 * at + 2 * W, r, here < i32(3 * count - 2 * W))
