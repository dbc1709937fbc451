"""Compiled: random paths of light from wall to wall through the distance field.

All positions are millimetres from the eye along world axes, all walls diffuse. A path
is made of its pixel's and its own number only, so that the light has the same bits in
any order and on any number of threads.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.shading.kernels.elementary import NEAREST_MM2, rotated
from renderers.shading.kernels.field_reads import (
    DistanceField,
    Place,
    is_outside,
    sobel_normal,
    tap,
    taps,
    to_voxels,
)
from renderers.simd import any_, bits, full, lanes, maximum, select, sqrt
from renderers.simd.arrays import Bytes, Doubles, Flags, Floats, f32, i32, u64

ARRIVED_MM = 0.002
"""A ray has met a wall that is nearer than this."""
LIFTED_MM = 0.02
"""A path leaves its wall from so far above it that it does not meet it at once.

Half of it moves the light of two nasal views by less than .1 %; four times as much
loses shadows in narrow places.
"""
MOST_OFF_MM = 0.08
"""No place that is met as a wall lies deeper behind it."""
SHORTEST_STEP_MM = 0.004
STEP_LIMIT = 256
ABREAST = 8
"""Sources that are looked for together."""
ROULETTE_FROM = 3
"""Bounces before a path may be ended by chance."""


class FibreLight(NamedTuple):
    """The scope's own light.

    sources: ``(n, 3)`` fibre ends, mm from the eye. forward: ``(3,)`` along the view.
    spread: mu of the spot law. each: intensity of one source.
    """

    sources: Floats
    forward: Floats
    spread: np.float32
    each: np.float32


class WallColour(NamedTuple):
    """What gives a wall its albedo.

    table: ``(256, 5)``, see `colour_table`. blood, skin: ``(nz, ny, nx)`` codes.
    skin_albedo: ``(3,)``. bone: ``(5,)``, a row as of the table. bias_root: square root
    of the factor on all blood.
    """

    table: Floats
    blood: Bytes
    skin: Bytes
    skin_albedo: Floats
    bone: Floats
    bias_root: np.float32


class SeenPoints(NamedTuple):
    """Where light is followed from: ``(h, w, 3)`` mm from the eye, and normals."""

    points: Floats
    normals: Floats
    shown: Flags


class BatchPlan(NamedTuple):
    """How a batch of paths is walked; `longest` is the mm of one flight."""

    seed: np.uint64
    batch: int
    paths: int
    bounces: int
    longest: np.float32


@njit(cache=True, nogil=True, error_model="numpy")
def mixed(x: np.uint64) -> np.uint64:
    """Scatter all bits over all bits (the finaliser of splitmix64)."""
    x ^= x >> u64(30)
    x *= u64(0xBF58476D1CE4E5B9)
    x ^= x >> u64(27)
    x *= u64(0x94D049BB133111EB)
    return x ^ (x >> u64(31))


@njit(cache=True, nogil=True, error_model="numpy")
def uniform(state: np.uint64) -> np.float32:
    """Return a number in [0, 1) for a state; a sequence is states a Weyl step apart."""
    return f32(mixed(state) >> u64(40)) * f32(2.0**-24)


@njit(cache=True, nogil=True, error_model="numpy")
def cosine_direction(
    nx: np.float32, ny: np.float32, nz: np.float32, u: np.float32, v: np.float32
) -> Place:
    """Return a direction about a normal, its density proportional to the cosine.

    u, v: in [0, 1), a point of the unit square.
    """
    radius = math.sqrt(u)
    turn = f32(2 * math.pi) * v
    a = f32(radius * math.cos(turn))
    b = f32(radius * math.sin(turn))
    c = f32(math.sqrt(max(f32(1) - u, f32(0))))
    # two directions across the normal, without a pole (Duff et al., JCGT 6, 2017)
    sign = f32(math.copysign(1.0, nz))
    p = f32(-1) / (sign + nz)
    q = nx * ny * p
    return (
        a * (f32(1) + sign * nx * nx * p) + b * q + c * nx,
        a * (sign * q) + b * (sign + ny * ny * p) + c * ny,
        a * (-sign * nx) + b * (-ny) + c * nz,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def lifted(field: DistanceField, at: Place, normal: Place) -> Place:
    """Return the place from which a ray leaves a wall: `LIFTED_MM` above its zero.

    Places are met a little before the wall or behind it: by how much, the field says.
    """
    x, y, z = to_voxels(field, at)
    h = f32(LIFTED_MM) + min(
        max(tap(field.values, x, y, z), f32(-LIFTED_MM)), f32(MOST_OFF_MM)
    )
    return at[0] + h * normal[0], at[1] + h * normal[1], at[2] + h * normal[2]


@njit(cache=True, nogil=True, error_model="numpy")
def sphere_trace(
    field: DistanceField, from_: Place, along: Place, longest: np.float32
) -> np.float32:
    """Return how far the wall is along a ray, -1 if none comes within `longest` mm."""
    distance, m, _ = field
    nz, ny, nx = distance.shape
    x0, y0, z0 = to_voxels(field, from_)
    vx, vy, vz = rotated(m, along[0], along[1], along[2])
    t = f32(0)
    for _ in range(STEP_LIMIT):
        x = x0 + t * vx
        y = y0 + t * vy
        z = z0 + t * vz
        if not (
            f32(0) <= x <= f32(nx - 1)
            and f32(0) <= y <= f32(ny - 1)
            and f32(0) <= z <= f32(nz - 1)
        ):
            return f32(-1)
        d = tap(distance, x, y, z)
        if d > f32(-ARRIVED_MM):
            # at most the rest of the way
            return t - min(d, f32(0))
        # the field is interpolated: slightly less than its promise is safe
        t += max(f32(-0.95) * d, f32(SHORTEST_STEP_MM))
        if t >= longest:
            return f32(-1)
    return f32(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_code(codes: Bytes, x: np.float32, y: np.float32, z: np.float32) -> int:
    """Return the code of the voxel nearest to voxel coordinates."""
    nz, ny, nx = codes.shape
    i = min(max(int(x + f32(0.5)), 0), nx - 1)
    j = min(max(int(y + f32(0.5)), 0), ny - 1)
    k = min(max(int(z + f32(0.5)), 0), nz - 1)
    return int(codes[k, j, i])


@njit(cache=True, nogil=True, error_model="numpy")
def table_row(colour: WallColour, x: np.float32, y: np.float32, z: np.float32) -> int:
    """Return the row of the colour table of the blood at voxel coordinates."""
    blood = f32(nearest_code(colour.blood, x, y, z)) * colour.bias_root
    row: int = min(int(blood + f32(0.5)), colour.table.shape[0] - 1)
    return row


@njit(cache=True, nogil=True, error_model="numpy")
def albedo_at(colour: WallColour, x: np.float32, y: np.float32, z: np.float32) -> Place:
    """Return a wall's albedo red, green, blue at voxel coordinates."""
    albedo, skin = colour.table, colour.skin_albedo
    row = table_row(colour, x, y, z)
    s = f32(nearest_code(colour.skin, x, y, z)) * f32(1 / 255)
    return (
        albedo[row, 0] + s * (skin[0] - albedo[row, 0]),
        albedo[row, 1] + s * (skin[1] - albedo[row, 1]),
        albedo[row, 2] + s * (skin[2] - albedo[row, 2]),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def visible_sources(
    field: DistanceField, at: Place, normal: Place, sources: Floats, first: int
) -> int:
    """Return which sources from `first` on a wall faces and sees: `ABREAST` bits.

    As `sphere_trace` finds it, to the bit; sources lie side by side, so that their ways
    are about as long.
    """
    distance, m, _ = field
    lane = lanes(ABREAST)
    here = lane < i32(sources.shape[0] - first)
    lx, ly, lz = full(f32(0), ABREAST), full(f32(0), ABREAST), full(f32(0), ABREAST)
    for s in range(first, min(first + ABREAST, sources.shape[0])):
        this = lane == i32(s - first)
        lx = select(this, sources[s, 0] - at[0], lx)
        ly = select(this, sources[s, 1] - at[1], ly)
        lz = select(this, sources[s, 2] - at[2], lz)
    longest = sqrt(lx * lx + ly * ly + lz * lz + f32(1e-6))
    lx /= longest
    ly /= longest
    lz /= longest
    live = here & (normal[0] * lx + normal[1] * ly + normal[2] * lz > f32(0))
    x0, y0, z0 = to_voxels(field, lifted(field, at, normal))
    vx, vy, vz = rotated(m, lx, ly, lz)
    t = full(f32(0), ABREAST)
    free = live
    for _ in range(STEP_LIMIT):
        if not any_(live):
            break
        x, y, z = x0 + t * vx, y0 + t * vy, z0 + t * vz
        live &= ~is_outside(distance, x, y, z)
        d = taps(distance, x, y, z)
        met = live & (d > f32(-ARRIVED_MM))
        free &= ~met
        live &= ~met
        t += select(live, maximum(f32(-0.95) * d, f32(SHORTEST_STEP_MM)), f32(0))
        live &= t < longest
    return int(bits(free))


@njit(cache=True, nogil=True, error_model="numpy")
def direct(
    field: DistanceField, at: Place, normal: Place, light: FibreLight
) -> np.float32:
    """Return what the scope's sources lay on a wall, shadows included."""
    sources, forward, spread, each = light
    total = f32(0)
    px, py, pz = at
    open_ = 0
    for s in range(sources.shape[0]):
        if s % ABREAST == 0:
            open_ = visible_sources(field, at, normal, sources, s)
        if not (open_ >> (s % ABREAST)) & 1:
            continue
        lx = sources[s, 0] - px
        ly = sources[s, 1] - py
        lz = sources[s, 2] - pz
        d2 = lx * lx + ly * ly + lz * lz + f32(1e-6)
        d = f32(math.sqrt(d2))
        lx /= d
        ly /= d
        lz /= d
        facing = normal[0] * lx + normal[1] * ly + normal[2] * lz
        away = f32(1) + (lx * forward[0] + ly * forward[1] + lz * forward[2])
        intensity = each * f32(math.exp(-spread * max(away, f32(0))))
        total += intensity * facing * min(f32(1) / d2, f32(1 / NEAREST_MM2))
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def walk(
    at: Place, normal: Place, u: np.float32, v: np.float32, state: np.uint64,
    plan: BatchPlan, field: DistanceField, light: FibreLight, colour: WallColour,
) -> Place:  # fmt: skip
    """Return the irradiance red, green, blue that one path brings to a wall.

    u, v: of the first direction. state: where the path's random numbers begin.
    """
    step = u64(0x9E3779B97F4A7C15)
    red = green = blue = f32(0)
    r = g = b = f32(1)
    for k in range(plan.bounces):
        from_ = lifted(field, at, normal)
        along = cosine_direction(normal[0], normal[1], normal[2], u, v)
        t = sphere_trace(field, from_, along, plan.longest)
        if t < f32(0):
            break
        at = from_[0] + t * along[0], from_[1] + t * along[1], from_[2] + t * along[2]
        x, y, z = to_voxels(field, at)
        normal = sobel_normal(field, x, y, z)
        rho = albedo_at(colour, x, y, z)
        r *= rho[0]
        g *= rho[1]
        b *= rho[2]
        lit = direct(field, at, normal, light)
        red += r * lit
        green += g * lit
        blue += b * lit
        if k + 1 >= ROULETTE_FROM:
            go_on = min(max(r, g, b) * f32(4), f32(1))
            state += step
            if uniform(state) >= go_on:
                break
            r /= go_on
            g /= go_on
            b /= go_on
        state += step
        u = uniform(state)
        state += step
        v = uniform(state)
    return red, green, blue


@njit(cache=True, nogil=True, error_model="numpy")
def walk_rows(
    seen: SeenPoints, plan: BatchPlan, field: DistanceField, light: FibreLight,
    colour: WallColour, total: Doubles, squares: Doubles,
    left: int, right: int, first: int, last: int,
) -> None:  # fmt: skip
    """Add the mean of a batch of paths, and its square, to every shown pixel.

    Of rows `first` to `last`, columns `left` to `right`, the ends left out.

    total, squares: ``(h, w, 3)``, irradiance red,
    green, blue of all light but that which comes straight from the sources. A batch's
    first directions are a lattice, turned at random for each pixel and batch: batches
    are independent of one another, the paths of one are not.
    """
    step = u64(0x9E3779B97F4A7C15)
    points, normals, shown = seen
    seed, batch, paths, _, _ = plan
    width = points.shape[1]
    batch_sum = np.zeros(3)
    for y in range(first, last):
        for x in range(left, right):
            if not shown[y, x]:
                continue
            at = points[y, x, 0], points[y, x, 1], points[y, x, 2]
            normal = normals[y, x, 0], normals[y, x, 1], normals[y, x, 2]
            pixel = mixed(u64(y * width + x) * step + seed)
            pixel = mixed(pixel + u64(batch) * step)
            turn_u = uniform(pixel)
            turn_v = uniform(pixel + step)
            batch_sum[:] = 0.0
            for p in range(paths):
                # Roberts' lattice: even at any number of paths
                u = f32((turn_u + 0.7548776662466927 * p) % 1.0)
                v = f32((turn_v + 0.5698402909980532 * p) % 1.0)
                start = mixed(pixel + u64(p + 2) * step)
                found = walk(at, normal, u, v, start, plan, field, light, colour)
                for c in range(3):
                    batch_sum[c] += found[c]
            for c in range(3):
                mean = batch_sum[c] / paths
                total[y, x, c] += mean
                squares[y, x, c] += mean * mean
