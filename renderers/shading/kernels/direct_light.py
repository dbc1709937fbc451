"""Compiled: what the scope's own sources do to a block of pixels.

Positions are millimetres from the eye along world axes.
"""

import numpy as np
from numba import njit

import renderers.shading.kernels.pixel_block as block
from renderers.shading.kernels.elementary import (
    NEAREST_MM2,
    exp_negative,
    load3,
    store3,
)
from renderers.shading.kernels.pixel_block import N
from renderers.shading.kernels.shadow import shadow
from renderers.simd import load, maximum, minimum, sqrt, store
from renderers.simd.arrays import Floats, f32


@njit(cache=True, nogil=True, error_model="numpy")
def light(
    w: Floats,
    sources: Floats,
    arcs: Floats,
    capsules: Floats,
    forward: Floats,
    spread: np.float32,
    power: np.float32,
) -> None:
    """Sum all sources: diffuse irradiance red and green, film radiance.

    arcs: ``(n, 3)`` mm, half the stretch of fibre ends a source stands for. capsules:
    what casts shadows, see `shadow.capsules`.
    """
    for s in range(sources.shape[0]):
        at = (sources[s, 0], sources[s, 1], sources[s, 2])
        aim(w, at, forward, spread, power)
        if capsules.shape[0]:
            shadow(w, at, (arcs[s, 0], arcs[s, 1], arcs[s, 2]), capsules)
        illuminate(w, s == 0)
        mirror(w, s == 0)


@njit(cache=True, nogil=True, error_model="numpy")
def aim(
    w: Floats,
    source: tuple[np.float32, np.float32, np.float32],
    forward: Floats,
    spread: np.float32,
    power: np.float32,
) -> None:
    """Find a source's direction and intensity at a block's points."""
    sx, sy, sz = source
    fx, fy, fz = forward[0], forward[1], forward[2]
    lx = sx - load(w, block.PX, N)
    ly = sy - load(w, block.PY, N)
    lz = sz - load(w, block.PZ, N)
    d2 = lx * lx + ly * ly + lz * lz + f32(1e-6)
    # one division for 1 / d and 1 / (d2 + 1)
    d = sqrt(d2)
    near = d2 + f32(1)
    both = f32(1) / (d * near)
    k = both * near
    lx *= k
    ly *= k
    lz *= k
    # cos theta between the view axis and the light's way to the surface
    away = f32(1) + (lx * fx + ly * fy + lz * fz)
    intensity = power * exp_negative(-spread * maximum(away, f32(0)))
    intensity *= minimum(k * k, f32(1 / NEAREST_MM2))
    store3(w, block.LX, lx, ly, lz)
    store(w, block.POWER, intensity)
    # a fibre bundle of .45 mm is no point: its angle widens the lobe
    store(w, block.SPREAD, f32(0.05) * (both * d))


@njit(cache=True, nogil=True, error_model="numpy")
def illuminate(w: Floats, first: bool) -> None:
    """Add a source's diffuse irradiance. first: set instead of add."""
    lx, ly, lz = load3(w, block.LX)
    intensity = load(w, block.POWER, N)
    # light wraps round an edge by about the way it creeps inside the tissue
    wrap = minimum(f32(0.25) * load(w, block.LR, N), f32(0.35))
    facing = load(w, block.NX, N) * lx + load(w, block.NY, N) * ly
    facing += load(w, block.NZ, N) * lz
    red = intensity * maximum(facing + wrap, f32(0))
    wrap = minimum(f32(0.25) * load(w, block.LG, N), f32(0.2))
    facing = load(w, block.TX, N) * lx + load(w, block.TY, N) * ly
    facing += load(w, block.TZ, N) * lz
    green = intensity * maximum(facing + wrap, f32(0))
    if not first:
        red += load(w, block.E_RED, N)
        green += load(w, block.E_GREEN, N)
    store(w, block.E_RED, red)
    store(w, block.E_GREEN, green)


@njit(cache=True, nogil=True, error_model="numpy")
def mirror(w: Floats, first: bool) -> None:
    """Add what the film reflects of the source: GGX, joint Smith, Schlick.

    With l and v of length 1 and m = l + v, m.m = 2 + 2 l.v; the half vector's cosines
    are h.m / |m| with the film's normal and |m| / 2 with l and v. first: set instead
    of add.
    """
    lx, ly, lz = load3(w, block.LX)
    dx, dy, dz = load3(w, block.DX)
    hx, hy, hz = load3(w, block.HX)
    hl = hx * lx + hy * ly + hz * lz
    hv = -(hx * dx + hy * dy + hz * dz)
    lv = -(dx * lx + dy * ly + dz * lz)
    a2 = minimum(load(w, block.A2, N) + load(w, block.SPREAD, N), f32(1))
    rest = f32(1) - a2
    mm = maximum(f32(2) + f32(2) * lv, f32(1e-6))
    hm = hl + hv
    base = maximum(mm - rest * (hm * hm), a2 * mm)
    f0 = load(w, block.F0, N)
    grazing = f32(1) - f32(0.5) * sqrt(mm)
    grazing2 = grazing * grazing
    fresnel = f0 + (f32(1) - f0) * (grazing2 * grazing2 * grazing)
    nl = maximum(hl, f32(0))
    nv = maximum(hv, f32(0.05))
    smith = nl * sqrt(nv * nv * rest + a2)
    smith += nv * sqrt(nl * nl * rest + a2)
    above = load(w, block.POWER, N) * nl * fresnel * (a2 * (mm * mm))
    spark = above / (base * base * (smith + f32(1e-4)))
    if not first:
        spark += load(w, block.SPARK, N)
    store(w, block.SPARK, spark)
