"""Compiled: shade rows of a G-buffer.

Pixels are worked on in blocks of 64. Each quantity of a block lies in its own stretch
of one scratch array at a constant offset: the compiler then sees that nothing
overlaps and turns the arithmetic loops into vector code, without fast-math, so that
the bits do not depend on how rows are dealt out. Only table and volume taps are
scalar. Positions are millimetres from the eye along world axes.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.shading.surface.block import (
    A2,
    BLUE,
    BOUNCE,
    CELL,
    COVER,
    DX,
    DY,
    DZ,
    E_GREEN,
    E_RED,
    F0,
    FOOT,
    GREEN,
    HX,
    HY,
    HZ,
    LG,
    LR,
    NX,
    NY,
    NZ,
    PX,
    PY,
    PZ,
    RED,
    SKIN,
    SLOTS,
    SPARK,
    TX,
    TY,
    TZ,
    UX,
    UY,
    UZ,
    WEIGHT,
    N,
    T,
)
from renderers.shading.tissue.kernels import paint

f32 = np.float32
i32 = np.int32
Floats = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def exp_negative(x: np.float32) -> np.float32:
    """Give exp(x) for x <= 0 to 2e-7, without a call, so that loops vectorise."""
    y = max(x * f32(1.4426950408889634), f32(-126.0)) + f32(127)
    k = i32(y)
    r = y - f32(k)
    p = f32(1.8775767e-3)
    p = p * r + f32(8.9893397e-3)
    p = p * r + f32(5.5826318e-2)
    p = p * r + f32(2.4015361e-1)
    p = p * r + f32(6.9315308e-1)
    p = p * r + f32(0.99999994)
    return p * i32(k << i32(23)).view(np.float32)


@njit(cache=True, nogil=True, error_model="numpy")
def fetch(
    w: Floats,
    count: int,
    depth: Floats,
    normal: Floats,
    coverage: Floats,
    lens: Floats,
    axes: Floats,
    to_voxel: Floats,
    eye: Floats,
    pixel: np.float32,
    y: int,
    x0: int,
) -> int:
    """Place a block: rays, points, voxels, footprints; return how many it shows."""
    seen = 0
    for i in range(N):
        x = x0 + min(i, count - 1)
        t = depth[y, x]
        c = coverage[y, x]
        if i < count and c > f32(0) and t < f32(1e6):
            seen += 1
            w[T + i] = max(t, f32(1e-3))
            w[COVER + i] = c
        else:
            w[T + i] = f32(1)
            w[COVER + i] = f32(0)
        w[DX + i] = lens[y, x, 0]
        w[DY + i] = lens[y, x, 1]
        w[DZ + i] = lens[y, x, 2]
        w[NX + i] = normal[y, x, 0]
        w[NY + i] = normal[y, x, 1]
        w[NZ + i] = normal[y, x, 2]
    if seen == 0:
        return 0
    for i in range(N):
        a = w[DX + i]
        b = w[DY + i]
        c = w[DZ + i]
        dx = a * axes[0, 0] + b * axes[1, 0] + c * axes[2, 0]
        dy = a * axes[0, 1] + b * axes[1, 1] + c * axes[2, 1]
        dz = a * axes[0, 2] + b * axes[1, 2] + c * axes[2, 2]
        t = w[T + i]
        facing = -(w[NX + i] * dx + w[NY + i] * dy + w[NZ + i] * dz)
        w[DX + i] = dx
        w[DY + i] = dy
        w[DZ + i] = dz
        x = t * dx
        y_ = t * dy
        z = t * dz
        w[PX + i] = x
        w[PY + i] = y_
        w[PZ + i] = z
        w[UX + i] = eye[0] + (
            to_voxel[0, 0] * x + to_voxel[0, 1] * y_ + to_voxel[0, 2] * z
        )
        w[UY + i] = eye[1] + (
            to_voxel[1, 0] * x + to_voxel[1, 1] * y_ + to_voxel[1, 2] * z
        )
        w[UZ + i] = eye[2] + (
            to_voxel[2, 0] * x + to_voxel[2, 1] * y_ + to_voxel[2, 2] * z
        )
        w[FOOT + i] = t * pixel / max(facing, f32(0.12))
        w[E_RED + i] = f32(0)
        w[E_GREEN + i] = f32(0)
        w[SPARK + i] = f32(0)
        w[BOUNCE + i] = f32(0)
        w[WEIGHT + i] = f32(0)
    return seen


@njit(cache=True, nogil=True, error_model="numpy")
def light(
    w: Floats,
    sx: np.float32,
    sy: np.float32,
    sz: np.float32,
    forward: Floats,
    spread: np.float32,
    power: np.float32,
) -> None:
    """Add one source: diffuse irradiance red and green, film radiance."""
    fx = forward[0]
    fy = forward[1]
    fz = forward[2]
    for i in range(N):
        lx = sx - w[PX + i]
        ly = sy - w[PY + i]
        lz = sz - w[PZ + i]
        d2 = lx * lx + ly * ly + lz * lz + f32(1e-6)
        k = f32(1) / math.sqrt(d2)
        lx *= k
        ly *= k
        lz *= k
        # cos theta between the view axis and the light's way to the surface
        away = f32(1) + (lx * fx + ly * fy + lz * fz)
        intensity = power * exp_negative(-spread * max(away, f32(0)))
        intensity /= max(d2, f32(0.6))
        red = min(f32(0.25) * w[LR + i], f32(0.35))
        green = min(f32(0.25) * w[LG + i], f32(0.2))
        # light wraps round an edge by about the way it creeps inside the tissue
        facing = w[NX + i] * lx + w[NY + i] * ly + w[NZ + i] * lz
        rest = f32(1) / (f32(1) + red)
        w[E_RED + i] += intensity * max(facing + red, f32(0)) * rest * rest
        facing = w[TX + i] * lx + w[TY + i] * ly + w[TZ + i] * lz
        rest = f32(1) / (f32(1) + green)
        w[E_GREEN + i] += intensity * max(facing + green, f32(0)) * rest * rest
        # film: GGX, joint Smith visibility, Schlick
        hx = w[HX + i]
        hy = w[HY + i]
        hz = w[HZ + i]
        vx = -w[DX + i]
        vy = -w[DY + i]
        vz = -w[DZ + i]
        mx = lx + vx
        my = ly + vy
        mz = lz + vz
        k = f32(1) / math.sqrt(mx * mx + my * my + mz * mz + f32(1e-12))
        nm = (hx * mx + hy * my + hz * mz) * k
        vm = (vx * mx + vy * my + vz * mz) * k
        nl = max(hx * lx + hy * ly + hz * lz, f32(0))
        nv = max(hx * vx + hy * vy + hz * vz, f32(0.05))
        # a fibre bundle of .45 mm is no point: its angle widens the lobe
        a2 = min(w[A2 + i] + f32(0.05) / (d2 + f32(1)), f32(1))
        base = nm * nm * (a2 - f32(1)) + f32(1)
        lobe = a2 / (f32(math.pi) * base * base + f32(1e-12))
        grazing = f32(1) - vm
        grazing2 = grazing * grazing
        f0 = w[F0 + i]
        fresnel = f0 + (f32(1) - f0) * grazing2 * grazing2 * grazing
        smith = nl * math.sqrt(nv * nv * (f32(1) - a2) + a2)
        smith += nv * math.sqrt(nl * nl * (f32(1) - a2) + a2)
        spark = intensity * nl * lobe * fresnel * f32(0.5) / (smith + f32(1e-4))
        w[SPARK + i] += spark * (f32(1) - f32(0.7) * w[SKIN + i])


@njit(cache=True, nogil=True, error_model="numpy")
def lift(w: Floats, grid: Floats, y: int, x0: int) -> None:
    """Bring the bounce light to full size: bilinear, but not across edges."""
    gj = y // CELL
    fv = f32(y - gj * CELL) * f32(1 / CELL)
    for cell in range(N // CELL):
        gi = x0 // CELL + cell
        if gi + 1 >= grid.shape[2]:
            break
        at = cell * CELL
        for corner in range(4):
            ci = gi + (corner & 1)
            cj = gj + (corner >> 1)
            t = grid[4, cj, ci]
            known = f32(0) if t <= f32(0) else f32(1)
            e = grid[0, cj, ci]
            nx = grid[1, cj, ci]
            ny = grid[2, cj, ci]
            nz = grid[3, cj, ci]
            row = fv if corner >> 1 else f32(1) - fv
            slope = f32(1 / CELL) if corner & 1 else f32(-1 / CELL)
            base = f32(0) if corner & 1 else f32(1)
            for i in range(CELL):
                p = at + i
                dt = (t - w[T + p]) / w[T + p]
                same = nx * w[NX + p] + ny * w[NY + p] + nz * w[NZ + p]
                same = max(same, f32(0))
                same *= same
                q = row * (base + slope * f32(i)) * (same * same + f32(1e-3))
                q = known * (q / (f32(1) + f32(400) * dt * dt) + f32(1e-5))
                w[WEIGHT + p] += q
                w[BOUNCE + p] += q * e


@njit(cache=True, nogil=True, error_model="numpy")
def shade_rows(
    depth: Floats,
    normal: Floats,
    coverage: Floats,
    material: NDArray[np.uint8],
    lens: Floats,
    axes: Floats,
    to_voxel: Floats,
    eye_voxel: Floats,
    eye_mm: Floats,
    pixel: np.float32,
    sources: Floats,
    spread: np.float32,
    power: np.float32,
    grid: Floats,
    bounce: np.float32,
    tint: NDArray[np.uint16],
    shape: tuple[int, int, int],
    blood_bias: np.float32,
    colours: Floats,
    skin_colour: Floats,
    materials: Floats,
    full: bool,
    tile: Floats,
    vessel_tile: Floats,
    to_tile: Floats,
    offsets: Floats,
    radiance: Floats,
    first: int,
    last: int,
) -> None:
    """Write linear radiance ``(h, w, 3)`` of rows ``first..last``.

    lens: camera-frame rays. axes: ``(3, 3)`` rows right, up, forward. to_voxel,
    eye_voxel: voxel = to_voxel @ (point - eye) + eye_voxel. eye_mm: the eye seen from
    the volume's centre. sources: ``(n, 3)`` mm from the eye. tint: blood code + 256 *
    skin code, flat, of `shape` (nz, ny, nx).
    """
    width = depth.shape[1]
    count_sources = sources.shape[0]
    w = np.zeros(SLOTS, np.float32)
    each = power / f32(count_sources)
    for y in range(first, last):
        for x0 in range(0, width, N):
            count = min(N, width - x0)
            seen = fetch(
                w, count, depth, normal, coverage, lens, axes, to_voxel, eye_voxel,
                pixel, y, x0,
            )  # fmt: skip
            if seen == 0:
                for i in range(count):
                    radiance[y, x0 + i, 0] = f32(0)
                    radiance[y, x0 + i, 1] = f32(0)
                    radiance[y, x0 + i, 2] = f32(0)
                continue
            paint(
                w, material, y, x0, count, tint, shape, blood_bias, colours,
                skin_colour, materials, full, tile, vessel_tile, to_tile, offsets,
                eye_mm,
            )  # fmt: skip
            for s in range(count_sources):
                light(
                    w, sources[s, 0], sources[s, 1], sources[s, 2], axes[2], spread,
                    each,
                )  # fmt: skip
            if bounce > f32(0):
                lift(w, grid, y, x0)
            finish(w, bounce)
            for i in range(count):
                radiance[y, x0 + i, 0] = w[E_RED + i]
                radiance[y, x0 + i, 1] = w[E_GREEN + i]
                radiance[y, x0 + i, 2] = w[BOUNCE + i]


@njit(cache=True, nogil=True, error_model="numpy")
def finish(w: Floats, bounce: np.float32) -> None:
    """Join direct, bounced and mirrored light; leave rgb in three slots."""
    for i in range(N):
        e = bounce * w[BOUNCE + i] / (w[WEIGHT + i] + f32(1e-6))
        f0 = w[F0 + i]
        cover = w[COVER + i]
        k = (f32(1) - f0) * f32(1 / math.pi)
        spark = w[SPARK + i]
        red = w[RED + i]
        green = w[GREEN + i]
        blue = w[BLUE + i]
        direct_green = w[E_GREEN + i]
        # the reflected light's own albedo, and further bounces as a series
        r = red * (w[E_RED + i] + e * red / (f32(1) - f32(0.6) * red))
        g = green * (direct_green + e * green / (f32(1) - f32(0.6) * green))
        b = blue * (direct_green + e * blue / (f32(1) - f32(0.6) * blue))
        w[E_RED + i] = cover * (k * r + spark)
        w[E_GREEN + i] = cover * (k * g + spark)
        w[BOUNCE + i] = cover * (k * b + spark)
