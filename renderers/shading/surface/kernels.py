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

from renderers.shading.bounce.kernels import lift
from renderers.shading.detail.kernels import exp_negative
from renderers.shading.surface.block import (
    A2,
    BLUE,
    BOUNCE,
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
from renderers.shading.tissue.kernels import paint, set_materials

f32 = np.float32
i32 = np.int32
Floats = NDArray[np.float32]


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
    for i in range(count):
        w[T + i] = depth[y, x0 + i]
    for i in range(count):
        w[COVER + i] = coverage[y, x0 + i]
    for i in range(count, N):
        w[COVER + i] = f32(0)
    seen = 0
    for i in range(N):
        shown = w[COVER + i] > f32(0) and w[T + i] < f32(1e6)
        w[COVER + i] = w[COVER + i] if shown else f32(0)
        w[T + i] = max(w[T + i], f32(1e-3)) if shown else f32(1)
        seen += 1 if shown else 0
    if seen == 0:
        return 0
    # flat, because the compiler must see that the stride is three
    start = 3 * (y * depth.shape[1] + x0)
    rays = lens.reshape(-1)[start:]
    normals = normal.reshape(-1)[start:]
    for i in range(count):
        w[DX + i] = rays[3 * i]
        w[DY + i] = rays[3 * i + 1]
        w[DZ + i] = rays[3 * i + 2]
    for i in range(count):
        w[NX + i] = normals[3 * i]
        w[NY + i] = normals[3 * i + 1]
        w[NZ + i] = normals[3 * i + 2]
    # into locals: the compiler cannot know that writing the block leaves them alone
    rx, ry, rz = axes[0, 0], axes[0, 1], axes[0, 2]
    ux, uy, uz = axes[1, 0], axes[1, 1], axes[1, 2]
    fx, fy, fz = axes[2, 0], axes[2, 1], axes[2, 2]
    ex, ey, ez = eye[0], eye[1], eye[2]
    m00, m01, m02 = to_voxel[0, 0], to_voxel[0, 1], to_voxel[0, 2]
    m10, m11, m12 = to_voxel[1, 0], to_voxel[1, 1], to_voxel[1, 2]
    m20, m21, m22 = to_voxel[2, 0], to_voxel[2, 1], to_voxel[2, 2]
    for i in range(N):
        a = w[DX + i]
        b = w[DY + i]
        c = w[DZ + i]
        t = w[T + i]
        dx = a * rx + b * ux + c * fx
        dy = a * ry + b * uy + c * fy
        dz = a * rz + b * uz + c * fz
        facing = -(w[NX + i] * dx + w[NY + i] * dy + w[NZ + i] * dz)
        w[FOOT + i] = t * pixel / max(facing, f32(0.12))
        w[DX + i] = dx
        w[DY + i] = dy
        w[DZ + i] = dz
        dx *= t
        dy *= t
        dz *= t
        w[PX + i] = dx
        w[PY + i] = dy
        w[PZ + i] = dz
        w[UX + i] = ex + (m00 * dx + m01 * dy + m02 * dz)
        w[UY + i] = ey + (m10 * dx + m11 * dy + m12 * dz)
        w[UZ + i] = ez + (m20 * dx + m21 * dy + m22 * dz)
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
            into = radiance.reshape(-1)[3 * (y * width + x0) :]
            seen = fetch(
                w, count, depth, normal, coverage, lens, axes, to_voxel, eye_voxel,
                pixel, y, x0,
            )  # fmt: skip
            if seen == 0:
                for i in range(3 * count):
                    into[i] = f32(0)
                continue
            set_materials(w, material, y, x0, count, materials)
            paint(
                w, count, tint, shape, blood_bias, colours, skin_colour, full, tile,
                vessel_tile, to_tile, offsets, eye_mm,
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
                into[3 * i] = w[E_RED + i]
                into[3 * i + 1] = w[E_GREEN + i]
                into[3 * i + 2] = w[BOUNCE + i]


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
