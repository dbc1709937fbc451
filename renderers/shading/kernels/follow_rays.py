"""Compiled: follow mirrored rays and light through thin walls, on a lattice of pixels.

Positions are millimetres from the eye along world axes. What is found at lattice
points is brought to all pixels with weights that do not reach across edges.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.shading.kernels.elementary import along_axes
from renderers.shading.kernels.field_reads import (
    DistanceField,
    Place,
    sobel_normal,
    tap,
    to_voxels,
)
from renderers.shading.kernels.path_tracing import (
    FibreLight,
    WallColour,
    albedo_at,
    direct,
    lifted,
    sphere_trace,
    table_row,
)
from renderers.shading.kernels.sphere_trace import sphere_trace_rays
from renderers.shading.kernels.thin_walls import likeness_to_wall, wall, with_cell
from renderers.simd import (
    full,
    greatest,
    lanes,
    load_where,
    maximum,
    minimum,
    select,
    swapped,
)
from renderers.simd.arrays import Bytes, Flags, Floats, f32

LONGEST_MM = f32(60.0)
THICKEST_MM = f32(2.5)
"""Through more than that comes no light one could see: red is down to a tenth."""
THINNEST_MM = f32(0.15)
"""The surface is known no better."""
STRAY_PER_MM = f32(1.7)
"""Reduced scattering of soft tissue between green and red (Jacques, Phys. Med. Biol.
58, 2013). What was not scattered goes on as it came, away from the eye that the light
is beside."""
FOUND = 9
"""Numbers found for a point: what it mirrors, the light through its wall, and the share
of its own diffuse light that its wall loses; red, green, blue each."""
STEP_MM = f32(0.05)
SERIES = f32(0.6)
"""Of the light that walls return again and again; as in the bounce light."""

TOGETHER = 16
"""Virtual lights summed together."""

TISSUE, METAL = 0, 1
FILM, MIRROR, THIN = 1, 2, 4
"""Bits of `wanted`."""


class BufferView(NamedTuple):
    """A G-buffer, its camera-frame rays ``(h, w, 3)``, and the camera's axes.

    axes: ``(3, 3)`` rows right, up, forward.
    """

    depth: Floats
    normal: Floats
    coverage: Floats
    material: Bytes
    lens: Floats
    axes: Floats


class LitWalls(NamedTuple):
    """The walls of a nose and the light on them.

    bounced: see `VirtualLights`, times `gain`.
    """

    field: DistanceField
    light: FibreLight
    colour: WallColour
    bounced: Floats
    gain: np.float32


@njit(cache=True, nogil=True, error_model="numpy")
def bounced(lights: Floats, at: Place, normal: Place) -> np.float32:
    """Return the irradiance of virtual lights for albedo 1; see `VirtualLights`.

    So many together, which is a thirtieth of the time of one after the other; summed
    in pairs in the end, so that all lanes hold the same sum.
    """
    count = lights.shape[1]
    total = full(f32(0), TOGETHER)
    for q in range(0, count, TOGETHER):
        here = lanes(TOGETHER) < np.int32(count - q)
        dx = load_where(lights, q, here) - at[0]
        dy = load_where(lights, count + q, here) - at[1]
        dz = load_where(lights, 2 * count + q, here) - at[2]
        d2 = dx * dx + dy * dy + dz * dz + load_where(lights, 7 * count + q, here)
        receive = maximum(normal[0] * dx + normal[1] * dy + normal[2] * dz, f32(0))
        emit = load_where(lights, 3 * count + q, here) * dx
        emit += load_where(lights, 4 * count + q, here) * dy
        emit += load_where(lights, 5 * count + q, here) * dz
        share = (
            load_where(lights, 6 * count + q, here) * receive * minimum(emit, f32(0))
        )
        total -= select(here, share / (d2 * d2), f32(0))
    total += swapped(total, 8)
    total += swapped(total, 4)
    total += swapped(total, 2)
    total += swapped(total, 1)
    irradiance: np.float32 = greatest(total) * f32(1 / math.pi)
    return irradiance


@njit(cache=True, nogil=True, error_model="numpy")
def mirrored(
    field: DistanceField, at: Place, ray: Place, normal: Place
) -> tuple[bool, Place, Place]:
    """Return where a mirrored ray begins and its direction, if it goes anywhere."""
    k = f32(-2) * (ray[0] * normal[0] + ray[1] * normal[1] + ray[2] * normal[2])
    along = ray[0] + k * normal[0], ray[1] + k * normal[1], ray[2] + k * normal[2]
    return bool(k > f32(0)), lifted(field, at, normal), along


@njit(cache=True, nogil=True, error_model="numpy")
def follow_on(
    at: Place, ray: Place, normal: Place, wanted: int, way: np.float32,
    walls: LitWalls, found: Floats,
) -> None:  # fmt: skip
    """Find what a point mirrors and what its wall does with light: `FOUND` numbers.

    ray: from the eye. way: mm to the wall along its mirrored ray; -1 where there is
    none, or nothing is mirrored. ``found[:3]``, ``found[3:6]``: radiance that is
    mirrored and that comes through the wall. ``found[6:]``: the share of the point's
    own diffuse light that goes through instead of back, beside a wall of
    `THICKEST_MM`; negative where bone shines through thin mucosa.
    """
    field, light, colour, lights, gain = walls
    found[:] = f32(0)
    if way >= f32(0):
        _, from_, along = mirrored(field, at, ray, normal)
        there = (
            from_[0] + way * along[0],
            from_[1] + way * along[1],
            from_[2] + way * along[2],
        )
        x, y, z = to_voxels(field, there)
        facing = sobel_normal(field, x, y, z)
        rho = albedo_at(colour, x, y, z)
        straight = direct(field, there, facing, light)
        other = gain * bounced(lights, there, facing)
        for c in range(3):
            series = rho[c] / (f32(1) - SERIES * rho[c])
            lit = straight + other * series
            found[c] = rho[c] * lit * f32(1 / math.pi)
    if wanted & THIN:
        t = f32(0)
        out = False
        x = y = z = f32(0)
        while t < THICKEST_MM:
            t += STEP_MM
            there = (
                at[0] - t * normal[0], at[1] - t * normal[1], at[2] - t * normal[2]
            )  # fmt: skip
            x, y, z = to_voxels(field, there)
            inside = tap(field.values, x, y, z)
            if inside < f32(0) and t > THINNEST_MM:
                out = True
                break
            t += max(f32(0.9) * inside - STEP_MM, f32(0))
        if out:
            behind = sobel_normal(field, x, y, z)
            share = likeness_to_wall(normal, behind)
            far = direct(field, there, behind, light)
            far *= f32(1) - f32(math.exp(-STRAY_PER_MM * t))
            far_bounce = gain * bounced(lights, there, behind)
            x, y, z = to_voxels(field, at)
            rho = albedo_at(colour, x, y, z)
            table, bone = colour.table, colour.bone
            row = table_row(colour, x, y, z)
            for c in range(3):
                length = table[row, 3 if c == 0 else 4]
                through, back = wall(
                    t, rho[c], length, bone[c], bone[3 if c == 0 else 4]
                )
                series = rho[c] / (f32(1) - SERIES * rho[c])
                lit = through * (far + far_bounce * series)
                found[3 + c] = share * lit * f32(1 / math.pi)
                # tissue has its colour as it lies upon bone: a thick wall has it all
                seen = with_cell(through, back, rho[c])
                through, back = wall(
                    THICKEST_MM, rho[c], length, bone[c], bone[3 if c == 0 else 4]
                )
                found[6 + c] = share * (
                    f32(1) - seen / with_cell(through, back, rho[c])
                )


@njit(cache=True, nogil=True, error_model="numpy")
def follow(
    at: Place, ray: Place, normal: Place, wanted: int, walls: LitWalls, found: Floats
) -> None:
    """Do as `follow_on` for a point by itself."""
    way = f32(-1)
    goes, from_, along = mirrored(walls.field, at, ray, normal)
    if goes and wanted & (FILM | MIRROR):
        way = sphere_trace(walls.field, from_, along, LONGEST_MM)
    follow_on(at, ray, normal, wanted, way, walls, found)


@njit(cache=True, nogil=True, error_model="numpy")
def wanted_of(material: int, effects: int) -> int:
    """Return which of the effects a material shows; the rest are matt or hidden."""
    if material == METAL:
        return effects & MIRROR
    if material == TISSUE:
        return effects & (FILM | THIN)
    return 0


@njit(cache=True, nogil=True, error_model="numpy")
def ray_of(lens: Floats, axes: Floats, y: int, x: int) -> Place:
    """Return a pixel's ray along world axes."""
    ray: Place = along_axes(axes, lens[y, x, 0], lens[y, x, 1], lens[y, x, 2])
    return ray


@njit(cache=True, nogil=True, error_model="numpy")
def follow_rows(
    view: BufferView, effects: int, stride: int, walls: LitWalls, points: Flags,
    grid: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Follow the light of every `stride`-th pixel, rows ``first..last`` of the grid.

    points: ``(gh, gw)``, those to follow. grid: ``(gh, gw, FOUND)``, see `follow`.
    Mirrored rays are followed first, all together.
    """
    depth, normal, coverage, material, lens, axes = view
    height, width = depth.shape
    columns = grid.shape[1]
    rays = np.empty(((last - first) * columns, 8), np.float32)
    ways = np.empty((len(rays) + 1, 4), np.float32)
    # row, column, what is wanted, and which ray is its mirrored one
    asked = np.empty((len(rays), 4), np.int32)
    many = mirroring = 0
    for gy in range(first, last):
        y = min(gy * stride, height - 1)
        for gx in range(columns):
            x = min(gx * stride, width - 1)
            wanted = wanted_of(material[y, x], effects)
            t = depth[y, x]
            hidden = coverage[y, x] <= f32(0) or not t < f32(1e6)
            if not points[gy, gx] or wanted == 0 or hidden:
                continue
            ray, of_wall = ray_of(lens, axes, y, x), normal[y, x]
            goes, from_, along = mirrored(
                walls.field, (t * ray[0], t * ray[1], t * ray[2]), ray,
                (of_wall[0], of_wall[1], of_wall[2]),
            )  # fmt: skip
            number = -1
            if goes and wanted & (FILM | MIRROR):
                number = mirroring
                mirroring += 1
                for k in range(3):
                    rays[number, k], rays[number, 3 + k] = from_[k], along[k]
            asked[many, 0], asked[many, 1] = gy, gx
            asked[many, 2], asked[many, 3] = wanted, number
            many += 1
    sphere_trace_rays(walls.field, rays[:mirroring], LONGEST_MM, ways)
    for n in range(many):
        gy, gx, wanted, number = asked[n, 0], asked[n, 1], asked[n, 2], asked[n, 3]
        y, x = min(gy * stride, height - 1), min(gx * stride, width - 1)
        t = depth[y, x]
        ray, of_wall = ray_of(lens, axes, y, x), normal[y, x]
        follow_on(
            (t * ray[0], t * ray[1], t * ray[2]), ray,
            (of_wall[0], of_wall[1], of_wall[2]),
            wanted, ways[number, 0] if number >= 0 else f32(-1), walls, grid[gy, gx],
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def blur_mirrored(
    depth: Floats, normal: Floats, material: Bytes, stride: int, reach: int,
    points: Flags, grid: Floats, blurred: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Blur what metal mirrors at `points`, rows ``first..last``; copy the rest.

    Ground steel is no looking-glass: its lobe is wider than the way from one lattice
    point to the next. reach: pixels over which a weight falls to nothing.
    """
    height, width = depth.shape
    rows, columns = grid.shape[0], grid.shape[1]
    steps = (reach - 1) // stride
    for gy in range(first, last):
        y = min(gy * stride, height - 1)
        for gx in range(columns):
            if not points[gy, gx]:
                continue
            x = min(gx * stride, width - 1)
            blurred[gy, gx] = grid[gy, gx]
            if material[y, x] != METAL:
                continue
            total = f32(0)
            red = green = blue = f32(0)
            for j in range(max(gy - steps, 0), min(gy + steps + 1, rows)):
                v = min(j * stride, height - 1)
                for i in range(max(gx - steps, 0), min(gx + steps + 1, columns)):
                    u = min(i * stride, width - 1)
                    if material[v, u] != METAL:
                        continue
                    k = f32(reach - abs(j - gy) * stride)
                    k *= f32(reach - abs(i - gx) * stride)
                    apart = depth[v, u] / depth[y, x] - f32(1)
                    k /= f32(1) + f32(100) * apart * apart
                    same = f32(0)
                    for c in range(3):
                        same += normal[y, x, c] * normal[v, u, c]
                    k *= max(same, f32(0))
                    total += k
                    red += k * grid[j, i, 0]
                    green += k * grid[j, i, 1]
                    blue += k * grid[j, i, 2]
            blurred[gy, gx, 0] = red / total
            blurred[gy, gx, 1] = green / total
            blurred[gy, gx, 2] = blue / total
