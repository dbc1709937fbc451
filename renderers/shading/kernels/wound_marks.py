"""Compiled: what a cut lays open, and blood on a surface, in a block of pixels.

How deep a point lay below the mucosa before anything was cut, its pristine distance,
tells what is seen there: raw flesh, the edge of a plate of bone, bare bone, what lies
beyond it. Torn flesh is rough; waves of its relief that are finer than a pixel make the
film on it dull in their place. Everything hangs on the place in the patient, so that
it keeps still when the scope moves. Nothing here moves a depth.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import renderers.shading.kernels.pixel_block as block
from renderers.shading.kernels.bump_normals import bent
from renderers.shading.kernels.elementary import (
    Three,
    exp_negative,
    load3,
    resolved,
    smooth,
    store3,
)
from renderers.shading.kernels.field_reads import DistanceField, taps
from renderers.shading.kernels.pixel_block import N, W
from renderers.shading.kernels.pushed_block import PushedField, voxel_at_rest
from renderers.shading.kernels.surface_noise import NoiseTile, tap_octave
from renderers.shading.kernels.tissue_surface import blend
from renderers.shading.kernels.wound_cubes import CUT, LEAST_DEPTH_MM, WET
from renderers.simd import (
    absolute,
    any_,
    full,
    gather_pairs,
    gather_u8,
    greatest,
    least,
    load,
    maximum,
    minimum,
    select,
    sqrt,
    store,
)
from renderers.simd import f32 as to_real
from renderers.simd import i32 as to_whole
from renderers.simd.arrays import Bytes, Floats, Lanes, Longs, f32, i32

RIM_MM = 0.10
"""Depth from which a surface is a cut one."""
TORN_MM = 0.025, 0.015
"""How ridges and grain move that depth, per standard deviation."""
RIM_WIDTH_MM = 0.30
"""Of the band of cut mucosa along the rim, which is paler than the flesh below."""

SHIFT = 3
"""Voxels along a side of a cube of `WoundField.cubes`, as a power of two."""
AROUND = 2
"""Voxels around a point that are read for it, at most."""

SHELL_MM = 0.7
"""Depth of dense bone over spongy bone."""

LUMPS_MM, RIDGES_MM, GRAIN_MM = 1.25, 0.50, 0.20
"""Wavelengths of a cut's relief."""

FLESH_LUMPS, FLESH_RIDGES, FLESH_GRAIN = f32(0.20), f32(0.34), f32(0.24)
BONE_LUMPS, BONE_RIDGES, BONE_GRAIN = f32(0.12), f32(0.18), f32(0.26)
"""Root mean square slopes of that relief."""

RED_PER_MM, GREEN_PER_MM = f32(6.0), f32(30.0)
"""What a film of blood takes from light, once through: red, and green and blue."""
POOL_FROM_MM, POOL_AT_MM = f32(0.03), f32(0.20)
"""A film so thick begins to fill the relief below it, and has filled it."""
POOL_RED = f32(0.72)
"""Blood that has been in tissue is darker than fresh arterial blood by this."""

_LUMPS = f32(LUMPS_MM / (2 * math.pi))
_RIDGES = f32(RIDGES_MM / (2 * math.pi))
_GRAIN = f32(GRAIN_MM / (2 * math.pi))
_HALF = f32(0.5)
_ONE = f32(1)
_ZERO = f32(0)

DEPTH, FILM, FLESH, BONE = block.LX, block.LY, block.LZ, block.POWER
FILM_X, FILM_Y, FILM_Z = block.SPREAD, block.E_RED, block.E_GREEN
"""Where a block's depths and layers are kept: no source has been looked at so far."""

MOST_SD = 6
"""Standard deviations of a relief's octave that none reaches."""
SURE_MM = f32(RIM_MM + sum(TORN_MM) * MOST_SD)
"""So deep no pixel shows anything of the mucosa, whatever the relief of its rim."""


class WoundRows(NamedTuple):
    """The rows of the material table that cuts and blood have."""

    flesh: int
    edge: int
    bone: int
    deep: int
    blood: int


class WoundField(NamedTuple):
    """What tells a block of pixels about cuts; all empty where nobody operates.

    pristine: ``(nz, ny, nx)`` mm. layers: flat, steps of depth of the bone + 256 *
    those of its thickness, 255 where it has no end. film: ``(nz, ny, nx)``. cubes: see
    `mark_cubes`. box: ``(6,)`` low and high voxel coordinates around all of them that
    have anything. to_tile: ``(3, 3, 3)`` mm to tile voxels of the relief's octaves.
    depth_step, film_step: mm a step. rows: of the material table. pushed: where what is
    shown lies at rest.
    """

    pristine: Floats
    layers: NDArray[np.uint16]
    film: Bytes
    cubes: Bytes
    box: Floats
    to_tile: Floats
    depth_step: np.float32
    film_step: np.float32
    rows: WoundRows
    pushed: PushedField


@njit(cache=True, nogil=True, error_model="numpy")
def wounds_in(w: Floats, cubes: Bytes, box: Floats, places: int) -> int:
    """Return what cubes that the shown pixels of a block touch have, bit by bit.

    places: the slot of the voxel coordinates that are looked at.
    """
    shown = load(w, block.COVER, N) > _ZERO
    x, y, z = load3(w, places)
    near = shown & (x > box[0]) & (y > box[1]) & (z > box[2])
    if not any_(near & (x < box[3]) & (y < box[4]) & (z < box[5])):
        return 0
    far = f32(1e6)
    low = (
        least(select(shown, x, far)),
        least(select(shown, y, far)),
        least(select(shown, z, far)),
    )
    high = (
        greatest(select(shown, x, -far)),
        greatest(select(shown, y, -far)),
        greatest(select(shown, z, -far)),
    )
    nc, nb, na = cubes.shape
    a0 = max(int(low[0]), 0) >> SHIFT
    b0 = max(int(low[1]), 0) >> SHIFT
    c0 = max(int(low[2]), 0) >> SHIFT
    a1 = min(int(max(high[0], _ZERO)) >> SHIFT, na - 1)
    b1 = min(int(max(high[1], _ZERO)) >> SHIFT, nb - 1)
    c1 = min(int(max(high[2], _ZERO)) >> SHIFT, nc - 1)
    found = 0
    for c in range(c0, c1 + 1):
        for b in range(b0, b1 + 1):
            for a in range(a0, a1 + 1):
                found |= cubes[c, b, a]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def film_at(film: Bytes, x: Lanes, y: Lanes, z: Lanes) -> Lanes:
    """Interpolate the thickness of blood at voxel coordinates, in its steps."""
    nz, ny, nx = film.shape
    x = minimum(maximum(x, _ZERO), f32(nx) - f32(1.001))
    y = minimum(maximum(y, _ZERO), f32(ny) - f32(1.001))
    z = minimum(maximum(z, _ZERO), f32(nz) - f32(1.001))
    i, j, k = to_whole(x), to_whole(y), to_whole(z)
    x -= to_real(i)
    y -= to_real(j)
    z -= to_real(k)
    at = i + j * i32(nx) + k * i32(nx * ny)
    every = at >= 0
    total = full(_ZERO, W)
    for corner in range(8):
        a, b, c = corner & 1, corner >> 1 & 1, corner >> 2
        voxel = at + i32(a + b * nx + c * nx * ny)
        share = x if a else _ONE - x
        share *= y if b else _ONE - y
        share *= z if c else _ONE - z
        total += share * to_real(gather_u8(film, voxel, every))
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def find_depths(
    w: Floats, field: DistanceField, wounds: WoundField, kinds: int, shown: int
) -> int:
    """Find a block's depths below the surface that was, its layers, and its film.

    kinds: bits of what the block has. shown: the slot of the voxel coordinates at which
    distances are read; layers and film are where tissue lies at rest. Returns the bits
    that the pixels have.
    """
    distance, m, _ = field
    nz, ny, nx = distance.shape
    row, layer = i32(nx), i32(nx * ny)
    step = f32(0.6)
    per_voxel = wounds.film_step / (f32(2) * step)
    found = 0
    for i in range(0, N, W):
        x = load(w, block.UX + i, W)
        y = load(w, block.UY + i, W)
        z = load(w, block.UZ + i, W)
        open_ = load(w, block.COVER + i, W) > _ZERO
        open_ &= load(w, block.SHARE + i, W) >= _ONE
        depth = full(_ZERO, W)
        if kinds & CUT:
            # what a splat lies beside the surface counts on both sides
            at_x = load(w, shown + i, W)
            at_y = load(w, shown + N + i, W)
            at_z = load(w, shown + 2 * N + i, W)
            depth = taps(wounds.pristine, at_x, at_y, at_z)
            depth -= taps(distance, at_x, at_y, at_z)
            depth = select(open_ & (depth > f32(LEAST_DEPTH_MM)), depth, _ZERO)
        store(w, DEPTH + i, depth)
        film = full(_ZERO, W)
        gx, gy, gz = film, film, film
        if kinds & WET:
            film = wounds.film_step * film_at(wounds.film, x, y, z)
            film = select(open_, film, _ZERO)
            if any_(film > POOL_FROM_MM):
                f = wounds.film
                gx = film_at(f, x + step, y, z)
                gx -= film_at(f, x - step, y, z)
                gy = film_at(f, x, y + step, z)
                gy -= film_at(f, x, y - step, z)
                gz = film_at(f, x, y, z + step)
                gz -= film_at(f, x, y, z - step)
        store(w, FILM + i, film)
        # from steps a voxel to mm a mm, along the world's axes
        store(w, FILM_X + i, per_voxel * (m[0, 0] * gx + m[1, 0] * gy + m[2, 0] * gz))
        store(w, FILM_Y + i, per_voxel * (m[0, 1] * gx + m[1, 1] * gy + m[2, 1] * gz))
        store(w, FILM_Z + i, per_voxel * (m[0, 2] * gx + m[1, 2] * gy + m[2, 2] * gz))
        if any_(film > _ZERO):
            found |= WET
        if not any_(depth > _ZERO):
            store(w, FLESH + i, depth)
            store(w, BONE + i, depth)
            continue
        found |= CUT
        x = minimum(maximum(x, _ZERO), f32(nx) - f32(1.001))
        y = minimum(maximum(y, _ZERO), f32(ny) - f32(1.001))
        z = minimum(maximum(z, _ZERO), f32(nz) - f32(1.001))
        a, b, c = to_whole(x), to_whole(y), to_whole(z)
        at = a + b * row + c * layer
        x -= to_real(a)
        y -= to_real(b)
        z -= to_real(c)
        c0 = gather_pairs(wounds.layers, at)
        c1 = gather_pairs(wounds.layers, at + row)
        c2 = gather_pairs(wounds.layers, at + layer)
        c3 = gather_pairs(wounds.layers, at + (row + layer))
        step_mm = wounds.depth_step
        store(w, FLESH + i, step_mm * blend(c0, c1, c2, c3, 0, x, y, z))
        store(w, BONE + i, step_mm * blend(c0, c1, c2, c3, 8, x, y, z))
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def clamped(x: Lanes) -> Lanes:
    """Bring numbers into 0..1."""
    return minimum(maximum(x, _ZERO), _ONE)


@njit(cache=True, nogil=True, error_model="numpy")
def past(x: Lanes, edge: Lanes, soft: Lanes) -> Lanes:
    """Return a smooth step from 0 to 1 where x passes an edge; soft: half its width."""
    return smooth(clamped((x - edge) / (soft + soft) + _HALF))


@njit(cache=True, nogil=True, error_model="numpy")
def mix_in(w: Floats, slot: int, share: Lanes, value: Lanes) -> None:
    """Blend a value into a quantity of a block."""
    old = load(w, slot, N)
    mixed = select(share > _ZERO, old + share * (value - old), old)
    # to the bit, whatever the old value is: what is hidden need not be found
    store(w, slot, select(share >= _ONE, value, mixed))


@njit(cache=True, nogil=True, error_model="numpy")
def set_layers(w: Floats, rows: WoundRows, materials: Floats) -> None:
    """Give cut pixels of a block the colour, the scattering and the film of its layer.

    Leaves in place of depths the share of cut surface, in that of the layer's
    depth the share of bone.
    """
    foot = load(w, block.FOOT, N)
    depth = load(w, DEPTH, N)
    lumps = load(w, block.LONG, N)
    ridges = load(w, block.MIDDLE, N) * resolved(foot, f32(1 / RIDGES_MM))
    grain = load(w, block.SHORT, N) * resolved(foot, f32(1 / GRAIN_MM))
    half_pixel = _HALF * foot
    edge = f32(RIM_MM) + f32(TORN_MM[0]) * ridges + f32(TORN_MM[1]) * grain
    cut = past(depth, edge, maximum(half_pixel, f32(0.05)))
    cut *= clamped((depth - f32(LEAST_DEPTH_MM)) * f32(20))

    # where bone begins and ends; its cover tears unevenly
    flesh = load(w, FLESH, N)
    thick = load(w, BONE, N)
    begin = flesh + f32(0.09) * lumps + f32(0.07) * ridges + f32(0.02) * grain
    end = flesh + thick + f32(0.05) * lumps + f32(0.04) * ridges
    end = maximum(end, begin)
    soft = maximum(half_pixel, f32(0.05))
    bone = past(depth, begin, soft)
    deep = past(depth, end, soft)
    # thick bone is spongy inside
    sponge = clamped((depth - begin - f32(SHELL_MM)) * f32(3))
    band = f32(0.15) + f32(0.05) * grain
    fringe = clamped(_ONE - absolute(depth - begin) / band)
    fringe = maximum(fringe, clamped(_ONE - absolute(depth - end) / band)) * bone

    # pale threads on some ridges, blood in the clefts between lumps
    crest = clamped(_ONE - absolute(ridges + f32(0.35) * grain) * f32(1.6))
    crest *= clamped(f32(0.7) * lumps - f32(0.05))
    cleft = clamped(f32(0.30) * absolute(ridges) - f32(0.40) * lumps)
    lining = clamped(_ONE - depth * f32(1 / RIM_WIDTH_MM) + f32(0.3) * ridges)
    lit = f32(1) + f32(0.12) * grain + f32(0.14) * lumps
    # deeper down the light finds more blood
    lit *= f32(1) - f32(0.30) * clamped(f32(0.5) * depth - f32(0.1))
    # blood smeared over bone, and what oozes from its pores
    smear = f32(0.32) - f32(0.20) * lumps - f32(0.18) * ridges - f32(0.06) * grain
    smear = clamped(smear + f32(0.30) * sponge + f32(0.65) * fringe)
    smear = minimum(smear, f32(0.85))
    pore = clamped(
        f32(-1.1) * grain - f32(0.55) * ridges - f32(2.0) + f32(0.5) * sponge
    )
    for c in range(3):
        pale = materials[rows.edge, 1 + c]
        dark = materials[rows.blood, 1 + c]
        value = full(materials[rows.flesh, 1 + c], N)
        value += deep * (materials[rows.deep, 1 + c] - value)
        value += f32(0.22) * crest * (pale - value)
        value += f32(0.42) * lining * (pale - value)
        value *= lit
        value += f32(0.75) * cleft * (f32(0.8) * dark - value)
        hard = full(materials[rows.bone, 1 + c], N)
        hard += smear * (materials[rows.flesh, 1 + c] - hard)
        hard += f32(0.8) * pore * (dark - hard)
        hard *= f32(1) + f32(0.05) * grain
        value += bone * (_ONE - deep) * (hard - value)
        mix_in(w, block.RED + c * N, cut, minimum(value, f32(0.9)))
    hardness = bone * (_ONE - deep)
    for c in range(2):
        value = materials[rows.flesh, 7 + c] + hardness * (
            materials[rows.bone, 7 + c] - materials[rows.flesh, 7 + c]
        )
        mix_in(w, block.LR + c * N, cut, value)
    f0 = materials[rows.flesh, 4]
    mix_in(w, block.F0, cut, f0 + hardness * (materials[rows.bone, 4] - f0))
    wet = materials[rows.flesh, 5] * materials[rows.flesh, 5]
    dull = materials[rows.bone, 5] * materials[rows.bone, 5]
    # bone under a rest of its cover is as wet as that
    dull = wet + hardness * (_ONE - fringe) * (dull - wet)
    mix_in(w, block.A2, cut, dull)
    skin = load(w, block.SKIN, N)
    store(w, block.SKIN, skin - cut * skin)
    store(w, DEPTH, cut)
    store(w, FLESH, hardness)
    store(w, BONE, clamped(depth * f32(3)))


@njit(cache=True, nogil=True, error_model="numpy")
def turned(
    w: Floats, slot: int, at: Three, marked: Lanes, share: Lanes, gradient: Three
) -> None:
    """Turn a block's marked normals at `slot`: towards bare ones, then by a gradient.

    at: bare normals. share: by how much towards them.
    """
    x, y, z = load3(w, slot)
    whole = share >= _ONE
    u = select(whole, at[0], x + share * (at[0] - x))
    v = select(whole, at[1], y + share * (at[1] - y))
    t = select(whole, at[2], z + share * (at[2] - z))
    k = _ONE / sqrt(u * u + v * v + t * t + f32(1e-20))
    u, v, t = bent(u * k, v * k, t * k, *gradient)
    store3(w, slot, select(marked, u, x), select(marked, v, y), select(marked, t, z))


@njit(cache=True, nogil=True, error_model="numpy")
def roughen(w: Floats) -> None:
    """Bend a block's normals by the relief of cuts, and level them where blood lies.

    DEPTH holds the share of cut surface, FLESH that of bone, BONE how much of its
    relief a cut has got, FILM the thickness of blood.
    """
    foot = load(w, block.FOOT, N)
    cut = load(w, DEPTH, N)
    film = load(w, FILM, N)
    bone = load(w, FLESH, N)
    pool = (film - POOL_FROM_MM) * f32(1 / (POOL_AT_MM - POOL_FROM_MM))
    pool = smooth(clamped(pool))
    rough = cut * load(w, BONE, N) * (_ONE - pool)
    # seen flatly, what rises hides what lies behind it
    facing = load(w, block.NX, N) * load(w, block.DX, N)
    facing += load(w, block.NY, N) * load(w, block.DY, N)
    facing += load(w, block.NZ, N) * load(w, block.DZ, N)
    rough *= clamped(f32(0.3) - f32(1.4) * facing)
    lumps = rough * (FLESH_LUMPS + bone * (BONE_LUMPS - FLESH_LUMPS))
    ridges = rough * (FLESH_RIDGES + bone * (BONE_RIDGES - FLESH_RIDGES))
    grain = rough * (FLESH_GRAIN + bone * (BONE_GRAIN - FLESH_GRAIN))
    w1 = resolved(foot, f32(1 / LUMPS_MM))
    w2 = resolved(foot, f32(1 / RIDGES_MM))
    w3 = resolved(foot, f32(1 / GRAIN_MM))
    unseen = lumps * lumps * (_ONE - w1 * w1)
    unseen += ridges * ridges * (_ONE - w2 * w2)
    unseen += grain * grain * (_ONE - w3 * w3)
    s1 = lumps * w1 * _LUMPS
    s2 = ridges * w2 * _RIDGES
    s3 = grain * w3 * _GRAIN
    ax, ay, az = load3(w, block.LONG + N)
    bx, by, bz = load3(w, block.MIDDLE + N)
    cx, cy, cz = load3(w, block.SHORT + N)
    gx = s1 * ax + s2 * bx + s3 * cx
    gy = s1 * ay + s2 * by + s3 * cy
    gz = s1 * az + s2 * bz + s3 * cz
    # a drop's rim is no cliff
    px, py, pz = load(w, FILM_X, N), load(w, FILM_Y, N), load(w, FILM_Z, N)
    flat = pool / sqrt(_ONE + px * px + py * py + pz * pz)
    px *= flat
    py *= flat
    pz *= flat
    marked = (cut > _ZERO) | (pool > _ZERO)
    bare = load3(w, block.NX)
    level = maximum(cut, pool)
    turned(w, block.HX, bare, marked, level, (gx + px, gy + py, gz + pz))
    part = f32(0.8)
    tissue = part * gx + px, part * gy + py, part * gz + pz
    turned(w, block.TX, bare, marked, level, tissue)
    part = f32(0.55)
    deep = part * gx + px, part * gy + py, part * gz + pz
    turned(w, block.NX, bare, marked, _ZERO * cut, deep)
    a2 = load(w, block.A2, N)
    store(w, block.A2, select(marked, a2 + f32(2) * unseen, a2))


@njit(cache=True, nogil=True, error_model="numpy")
def spread_blood(w: Floats, blood: int, materials: Floats) -> None:
    """Lay a film of blood over a block: it takes light twice, and then is a pool."""
    film = load(w, FILM, N)
    # it gathers in clefts, and its edge is uneven
    uneven = _ONE - f32(0.25) * load(w, block.LONG, N) * load(w, DEPTH, N)
    uneven -= f32(0.18) * load(w, block.MIDDLE, N)
    film *= minimum(maximum(uneven, f32(0.3)), f32(2))
    # nothing where there is none: the exponential of 0 is not quite 1
    wet = film > _ZERO
    red = _ONE - exp_negative(f32(-2) * RED_PER_MM * film)
    red = select(wet, red, _ZERO)
    green = _ONE - exp_negative(f32(-2) * GREEN_PER_MM * film)
    green = select(wet, green, _ZERO)
    mix_in(w, block.RED, red, full(POOL_RED * materials[blood, 1], N))
    mix_in(w, block.GREEN, green, full(materials[blood, 2], N))
    mix_in(w, block.BLUE, green, full(materials[blood, 3], N))
    mix_in(w, block.LR, red, full(materials[blood, 7], N))
    mix_in(w, block.LG, green, full(materials[blood, 8], N))
    pool = (film - POOL_FROM_MM) * f32(1 / (POOL_AT_MM - POOL_FROM_MM))
    pool = smooth(clamped(pool))
    mix_in(w, block.F0, pool, full(materials[blood, 4], N))
    a2 = materials[blood, 5] * materials[blood, 5]
    mix_in(w, block.A2, pool, full(a2, N))
    skin = load(w, block.SKIN, N)
    store(w, block.SKIN, skin - pool * skin)


@njit(cache=True, nogil=True, error_model="numpy")
def find_wounds(w: Floats, field: DistanceField, wounds: WoundField, shown: int) -> int:
    """Find what a block shows of cuts and blood; return the bits that it has.

    shown: the slot of the voxel coordinates where the block is seen, `block.UX` if it
    lies at rest there.
    """
    kinds = wounds_in(w, wounds.cubes, wounds.box, block.UX)
    if shown != block.UX:
        # cuts are marked where they are shown, blood where it lies
        kinds |= wounds_in(w, wounds.cubes, wounds.box, shown)
    if kinds == 0:
        return 0
    return find_depths(w, field, wounds, kinds, shown)


@njit(cache=True, nogil=True, error_model="numpy")
def hides_surface(w: Floats, kinds: int) -> bool:
    """Say if a block shows nothing but cuts, so that no mucosa need be looked for.

    After `find_wounds`, which returned `kinds`. What `find_surface` would leave for
    `mark_wounds` is then left so that it can be mixed in by a share of zero.
    """
    if kinds & CUT == 0:
        return False
    sure = SURE_MM + maximum(_HALF * load(w, block.FOOT, N), f32(0.05))
    if any_((load(w, block.COVER, N) > _ZERO) & (load(w, DEPTH, N) < sure)):
        return False
    store(w, block.SKIN, full(_ZERO, N))
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def mark_wounds(
    w: Floats,
    eye_mm: Floats,
    wounds: WoundField,
    tile: NoiseTile,
    materials: Floats,
    kinds: int,
) -> None:
    """Turn what a block shows of cuts and blood into these, after `find_surface`.

    eye_mm: the eye seen from the volume's centre. kinds: of `find_wounds`. Pixels that
    are neither cut nor wet keep their bits.
    """
    at = (eye_mm[0], eye_mm[1], eye_mm[2])
    tap_octave(w, tile, wounds.to_tile, 0, at, False, block.LONG)
    tap_octave(w, tile, wounds.to_tile, 1, at, False, block.MIDDLE)
    tap_octave(w, tile, wounds.to_tile, 2, at, False, block.SHORT)
    set_layers(w, wounds.rows, materials)
    roughen(w)
    if kinds & WET:
        spread_blood(w, wounds.rows.blood, materials)


@njit(cache=True, nogil=True, error_model="numpy")
def stain_walls(
    distance: Floats, wounds: WoundField, blood: Bytes, codes: tuple[int, int],
    near: np.float32, stained: Bytes, low: Longs, high: Longs,
    to_voxel: Floats,
) -> None:  # fmt: skip
    """Write the blood codes of walls as cuts and blood on them change it, in a box.

    For light that comes by way of these walls, which sees no detail. blood: codes of
    the healthy walls. codes: of raw flesh and of bone. near: mm, see `mark_cubes`.
    low, high: the first and last voxel (i, j, k). to_voxel: ``(3, 3)``, from mm.
    """
    pristine, film, pushed = wounds.pristine, wounds.film, wounds.pushed
    _, ny, nx = distance.shape
    is_pushed = pushed.box[3] > pushed.box[0]
    for k in range(low[2], high[2] + 1):
        for j in range(low[1], high[1] + 1):
            for i in range(low[0], high[0] + 1):
                a, b, c = i, j, k
                if is_pushed:
                    a, b, c = voxel_at_rest(pushed, to_voxel, i, j, k)
                code = float(blood[c, b, a])
                d = distance[k, j, i]
                if abs(d) < near:
                    depth = pristine[k, j, i] - d
                    if depth > f32(RIM_MM):
                        both = int(wounds.layers[(c * ny + b) * nx + a])
                        begin = wounds.depth_step * f32(both & 255)
                        end = begin + wounds.depth_step * f32(both >> 8)
                        hard = begin < depth < end
                        code = float(codes[1] if hard else codes[0])
                    if film[c, b, a] > 0:
                        thick = wounds.film_step * f32(film[c, b, a])
                        share = math.exp(-f32(2) * GREEN_PER_MM * thick)
                        code = 255.0 + share * (code - 255.0)
                stained[k, j, i] = np.uint8(code + 0.5)
