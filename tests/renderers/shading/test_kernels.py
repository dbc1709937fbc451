"""The whole shading kernel against the same picture in plain numpy, float64."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer
from renderers.shading import Effects, ScopeLight, ScopeShader, Tier
from renderers.shading.bounce_light import VirtualLights
from renderers.shading.kernels.surface_noise import TILE_SIZE, NoiseTile
from renderers.shading.shader import BOUNCE_FACTOR
from renderers.shading.surface_look import surface_tables, tint_of
from tests.renderers.shading.conftest import trace

Array = NDArray[Any]
SEED = 7


def dot(a: Array, b: Array) -> Array:
    total: Array = (a * b).sum(axis=-1)
    return total


def unit(v: Array) -> Array:
    result: Array = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return result


def smoothstep(low: float, high: float, x: Array) -> Array:
    t = np.clip((x - low) / (high - low), 0, 1)
    result: Array = t * t * (3 - 2 * t)
    return result


def tap(
    stored: NoiseTile, matrix: Array, points: Array, ease: bool
) -> tuple[Array, Array]:
    """Give value ``(n,)`` and gradient per mm ``(n, 3)``."""
    tile = stored.quads.reshape((TILE_SIZE + 1,) * 3 + (4,)) * float(stored.unit)
    m = matrix.astype(np.float64)
    u = points @ m.T
    low = np.floor(u)
    t = u - low
    if ease:
        t = t * t * (3 - 2 * t)
    total = np.zeros((len(points), 4))
    for c in range(8):
        step = np.array([c & 1, c >> 1 & 1, c >> 2])
        i, j, k = ((low.astype(int) + step) % TILE_SIZE).T
        total += np.where(step, t, 1 - t).prod(axis=1)[:, None] * tile[k, j, i]
    return total[:, 0], total[:, 1:] @ m


def vessel(
    value: Array, slope: Array, radius: Array, edge: Array, foot: Array, flat: float
) -> Array:
    soft = np.maximum(edge, 0.7 * foot)
    cover = 1 - smoothstep(-1, 1, (np.abs(value) / slope - radius) / soft)
    cover = cover * np.minimum(1, radius / (0.7 * foot))
    result: Array = np.where((radius > 0) & (slope > flat), cover, 0)
    return result


class Twin:
    """Shade the covered pixels of one G-buffer."""

    def __init__(
        self, surface: AirSurface, buffer: GBuffer, camera: Camera, tier: Tier
    ) -> None:
        self.look = surface_tables(
            tint_of(surface.blood.values, surface.skin.values), SEED, 1.0, True
        )
        self.tier = tier
        self.camera = camera
        self.light = ScopeLight()
        self.seen = buffer.coverage > 0
        _, rays = camera.rays()
        self.rays = rays[self.seen]
        self.t = buffer.depth_mm[self.seen].astype(np.float64)
        self.n = buffer.normal[self.seen].astype(np.float64)
        self.cover = buffer.coverage[self.seen].astype(np.float64)
        self.material = self.look.materials[buffer.material[self.seen]].astype(float)
        self.p = self.t[:, None] * self.rays
        self.mm = self.p + camera.eye_mm - surface.distance.center_mm
        self.foot = self.t * camera.radians_per_pixel
        self.foot = self.foot / np.maximum(-dot(self.n, self.rays), 0.12)
        codes = self.look.tint.reshape(surface.distance.shape)
        self.code, self.skin = (
            surface.distance.with_values(c.astype(np.float32), 0.0).sample(
                self.p + camera.eye_mm
            )
            for c in (codes & 255, codes >> 8)
        )
        self.skin = self.skin / 255 * self.material[:, 0]
        lights = VirtualLights.trace(
            surface.distance, camera, self.light, tier.virtual_lights
        )
        self.grid = lights.gather(buffer, camera).astype(np.float64)

    def octave(self, which: int) -> tuple[Array, Array]:
        look = self.look
        return tap(look.tile, look.to_tile[which], self.mm, False)

    def vessels(self, m1: Array, m2: Array, m3: Array, blood: Array) -> Array:
        look, foot = self.look, self.foot
        cover = np.zeros_like(blood)
        for o, (bend, axes, radius, edge, strength, flat) in enumerate(
            (
                (0.22 * m2, (1, 0, 1), 0.042 * (0.55 + 0.45 * m1), 0.55, 0.6, 0.12),
                (0.05 * m3, (0, 1, 1), 0.022 * (0.5 + 0.6 * m2), 0.6, 0.45, 0.35),
            )
        ):
            at = self.mm + look.offsets[o] + bend[:, None] * np.array(axes)
            value, gradient = tap(look.vessel_tile, look.to_tile[3 + o], at, True)
            gradient = gradient - dot(gradient, self.n)[:, None] * self.n
            slope = np.linalg.norm(gradient, axis=1)
            soft = edge * radius + (0.02, 0.015)[o]
            found = vessel(value, slope, radius, soft, foot, flat)
            cover = np.maximum(cover, strength * found)
            if self.tier is Tier.LIVE:
                break  # large vessels only
        result: Array = blood + cover * (1 - self.skin) * (0.10 + 1.6 * blood)
        return result

    def paint(self) -> None:
        """Find albedo, lengths, the three normals and the film's roughness."""
        full = self.tier is not Tier.LIVE
        w2, w3 = (1 - smoothstep(0.25, 0.5, self.foot / k) for k in (1.6, 0.55))
        (m1, g1), (m2, g2) = self.octave(0), self.octave(1)
        m3, g3 = np.zeros_like(m2), np.zeros_like(g2)
        if full:
            m3, g3 = self.octave(2)
            blood = (self.code / 255) ** 2
            blood = blood * np.exp(0.26 * m1 + 0.11 * w2 * m2 + 0.07 * w3 * m3)
            blood = self.vessels(m1, m2, m3, blood)
            self.code = 255 * np.sqrt(np.minimum(blood, 1))
        else:
            w3 = np.zeros_like(w3)
            blood = (self.code / 255) ** 2 * np.exp(0.26 * m1 + 0.11 * w2 * m2)
            blood = self.vessels(m1, m2, m3, blood)
            self.code = 255 * np.sqrt(np.minimum(blood, 1))
        relief = self.material[:, 6]

        def bent(long: float, middle: float, short: float) -> Array:
            bend = np.zeros_like(self.n)
            for slope, wave, weight, gradient in (
                (long, 6.5, np.ones_like(w2), g1),
                (middle, 1.6, w2, g2),
                (short, 0.55, w3, g3),
            ):
                scale = relief * slope * wave / (2 * math.pi) * weight
                bend = bend + scale[:, None] * gradient
            return unit(self.n - (bend - dot(bend, self.n)[:, None] * self.n))

        self.film, self.tissue = bent(0.06, 0.09, 0.04), bent(0, 0.06, 0.04)
        rough = 2 * (0.09**2 * (1 - w2**2) + 0.04**2 * (1 - w3**2))
        a2 = self.material[:, 5] ** 2 + relief**2 * rough
        self.a2 = a2 + self.skin * np.maximum(0.12 - a2, 0)
        rows = self.look.colours.reshape(-1, 8)[:, :5].astype(np.float64)
        tissue = np.stack(
            [np.interp(self.code, np.arange(256), rows[:, c]) for c in range(5)], -1
        )
        skin = self.skin[:, None]
        tissue[:, :3] += skin * (self.look.skin - tissue[:, :3])
        tissue *= self.material[:, :1]
        self.albedo = tissue[:, :3] + self.material[:, 1:4]
        self.red_mm, self.green_mm = (tissue[:, 3:] + self.material[:, 7:9]).T

    def bounce(self) -> Array:
        """Lift the gathered grid by joint bilateral weights."""
        rows, columns = np.nonzero(self.seen)
        total = weight = np.zeros(len(rows))
        for corner in range(4):
            right, below = corner & 1, corner >> 1
            e, x, y, z, t = self.grid[:, rows // 8 + below, columns // 8 + right]
            u, v = columns % 8 / 8, rows % 8 / 8
            q = (u if right else 1 - u) * (v if below else 1 - v)
            same = np.maximum(dot(np.stack([x, y, z], -1), self.n), 0) ** 4
            q = q * (same + 1e-3) / (1 + 400 * ((t - self.t) / self.t) ** 2) + 1e-5
            q = np.where(t > 0, q, 0)
            weight, total = weight + q, total + q * e
        result: Array = BOUNCE_FACTOR * total / (weight + 1e-6)
        return result

    def shade(self) -> Array:
        """Give the picture ``(h, w, 3)``."""
        self.paint()
        view, f0 = -self.rays, self.material[:, 4]
        red = green = spark = np.zeros(len(self.t))
        sources = self.light.sources(self.camera, self.tier.sources)
        for source in sources:
            away = source - self.p
            d2 = dot(away, away) + 1e-6
            away = away / np.sqrt(d2)[:, None]
            power = np.exp(-2.8 * np.maximum(1 + away @ self.camera.frame[3], 0))
            power = power / np.maximum(d2, 0.6) / len(sources)
            r = np.minimum(0.25 * self.red_mm, 0.35)
            g = np.minimum(0.25 * self.green_mm, 0.2)
            red = red + power * np.maximum(dot(self.n, away) + r, 0) / (1 + r) ** 2
            wrapped = np.maximum(dot(self.tissue, away) + g, 0) / (1 + g) ** 2
            green = green + power * wrapped
            middle = unit(away + view)
            nm, vm = dot(self.film, middle), dot(view, middle)
            nl = np.maximum(dot(self.film, away), 0)
            nv = np.maximum(dot(self.film, view), 0.05)
            a2 = np.minimum(self.a2 + 0.05 / (d2 + 1), 1)
            lobe = a2 / (math.pi * (nm**2 * (a2 - 1) + 1) ** 2)
            fresnel = f0 + (1 - f0) * (1 - vm) ** 5
            smith = nl * np.sqrt(nv**2 * (1 - a2) + a2)
            smith += nv * np.sqrt(nl**2 * (1 - a2) + a2)
            shine = power * nl * lobe * fresnel * 0.5 / (smith + 1e-4)
            spark = spark + shine * (1 - 0.7 * self.skin)
        rho = self.albedo
        direct = np.stack([red, green, green], axis=-1)
        body = rho * (direct + self.bounce()[:, None] * rho / (1 - 0.6 * rho))
        body *= ((1 - f0) / math.pi)[:, None]
        picture = np.zeros((*self.seen.shape, 3))
        picture[self.seen] = self.cover[:, None] * (body + spark[:, None])
        return picture


@pytest.mark.parametrize("is_odd", [False, True])
@pytest.mark.parametrize("tier", [Tier.LIVE, Tier.FULL])
def test_the_kernel_is_the_formula(
    surface: AirSurface, camera: Camera, gbuffer: GBuffer, tier: Tier, is_odd: bool
) -> None:
    """Also where rows and columns are no whole number of blocks."""
    if is_odd:
        camera = camera.with_size(37, 29)
        gbuffer = trace(surface, camera)
        gbuffer.material[8:22, 12:26] = np.arange(14) // 2
    expected = Twin(surface, gbuffer, camera, tier).shade()
    shader = ScopeShader(surface, tier, SEED, threads=1, effects=Effects.none())
    got = shader.shade(gbuffer, camera, ScopeLight())
    error = np.abs(got - expected)
    # radiance is of order .01 here; glints amplify what float32 leaves of a normal
    assert float(error.max()) < 1e-5
    assert float(error.mean()) < 1e-4 * float(expected.mean())
