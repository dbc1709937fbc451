import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.capsules import COLUMNS
from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.direct_light import light

f32 = np.float32
N = b.N
FORWARD = np.array([0, 0, 1], np.float32)
EYE = np.zeros((1, 3), np.float32)


NO_RODS = np.zeros((0, COLUMNS), np.float32)


def lit(
    w: NDArray[np.float32],
    sources: NDArray[np.float32],
    forward: NDArray[np.float32],
    spread: np.float32,
    power: np.float32,
) -> None:
    """Light a block from points, with nothing in the way."""
    light(w, sources, np.zeros_like(sources), NO_RODS, forward, spread, power)


def facing_plane(depth_mm: NDArray[np.float64]) -> NDArray[np.float32]:
    """Put N pixels on the view axis, facing the eye, without film or scattering."""
    w = np.zeros(b.SLOTS, np.float32)
    w[b.PZ : b.PZ + N] = depth_mm
    w[b.DZ : b.DZ + N] = 1
    for slot in (b.NZ, b.TZ, b.HZ):
        w[slot : slot + N] = -1
    w[b.A2 : b.A2 + N] = 0.1
    return w


def random_block(seed: int) -> NDArray[np.float32]:
    """Fill a block with anything a pixel may be."""
    rng = np.random.default_rng(seed)
    w = np.zeros(b.SLOTS, np.float32)

    def unit() -> NDArray[np.float64]:
        v = rng.normal(size=(3, N))
        v /= np.linalg.norm(v, axis=0)
        return v

    ray = unit()
    depth = rng.uniform(0.05, 40, N)
    w[b.DX : b.DX + 3 * N] = ray.reshape(-1)
    w[b.PX : b.PX + 3 * N] = (depth * ray).reshape(-1)
    for slot in (b.NX, b.TX, b.HX):
        w[slot : slot + 3 * N] = unit().reshape(-1)
    w[b.LR : b.LR + N] = rng.uniform(0, 3, N)
    w[b.LG : b.LG + N] = rng.uniform(0, 3, N)
    w[b.A2 : b.A2 + N] = rng.uniform(0.002, 0.2, N)
    w[b.F0 : b.F0 + N] = rng.uniform(0.02, 0.6, N)
    w[b.SKIN : b.SKIN + N] = rng.uniform(0, 1, N)
    return w


def part(w: NDArray[np.float32], slot: int) -> NDArray[np.float64]:
    return w[slot : slot + N].astype(np.float64)


def vector(w: NDArray[np.float32], slot: int) -> NDArray[np.float64]:
    return w[slot : slot + 3 * N].reshape(3, N).astype(np.float64)


def light_twin(
    w: NDArray[np.float32], source: NDArray[np.float64], spread: float, power: float
) -> NDArray[np.float64]:
    """Give (3, N): irradiance of red, of green, and film radiance, in float64.

    As `light` leaves them: without the factors that are the same for all sources.
    """
    to_light = source[:, None] - vector(w, b.PX)
    d2 = (to_light**2).sum(axis=0) + 1e-6
    l_dir = to_light / np.sqrt(d2)
    cosine = -(l_dir * FORWARD[:, None]).sum(axis=0)
    intensity = power * np.exp(-spread * np.maximum(1 - cosine, 0))
    intensity /= np.maximum(d2, 0.6)

    def wrapped(
        normal: NDArray[np.float64], wrap: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        facing = (normal * l_dir).sum(axis=0)
        lit_: NDArray[np.float64] = intensity * np.maximum(facing + wrap, 0)
        return lit_

    red = wrapped(vector(w, b.NX), np.minimum(0.25 * part(w, b.LR), 0.35))
    green = wrapped(vector(w, b.TX), np.minimum(0.25 * part(w, b.LG), 0.2))
    view, film = -vector(w, b.DX), vector(w, b.HX)
    middle = l_dir + view
    middle /= np.sqrt((middle**2).sum(axis=0) + 1e-12)
    nm, vm = (film * middle).sum(axis=0), (view * middle).sum(axis=0)
    nl = np.maximum((film * l_dir).sum(axis=0), 0)
    nv = np.maximum((film * view).sum(axis=0), 0.05)
    a2 = np.minimum(part(w, b.A2) + 0.05 / (d2 + 1), 1)
    lobe = a2 / (nm**2 * (a2 - 1) + 1) ** 2
    f0 = part(w, b.F0)
    fresnel = f0 + (1 - f0) * (1 - vm) ** 5
    smith = nl * np.sqrt(nv**2 * (1 - a2) + a2) + nv * np.sqrt(nl**2 * (1 - a2) + a2)
    spark = intensity * nl * lobe * fresnel / (smith + 1e-4)
    return np.stack([red, green, spark])


def test_light_falls_with_the_square_of_the_distance() -> None:
    depth = np.linspace(1, 60, N)
    w = facing_plane(depth)
    lit(w, EYE, FORWARD, f32(2.8), f32(1))
    for slot in (b.E_RED, b.E_GREEN):
        np.testing.assert_allclose(part(w, slot) * depth**2, 1, rtol=5e-6)


def test_near_the_fibres_light_does_not_grow_without_bound() -> None:
    w = facing_plane(np.linspace(0.2, 0.7, N))
    lit(w, EYE, FORWARD, f32(2.8), f32(1))
    np.testing.assert_allclose(part(w, b.E_RED), 1 / 0.6, rtol=1e-4)


def test_the_spot_darkens_by_its_law() -> None:
    theta = np.linspace(0, 1.2, N)
    w = facing_plane(np.ones(N))
    w[b.PX : b.PX + N] = 10 * np.sin(theta)
    w[b.PZ : b.PZ + N] = 10 * np.cos(theta)
    w[b.NX : b.NX + N] = -np.sin(theta)
    w[b.NZ : b.NZ + N] = -np.cos(theta)
    lit(w, EYE, FORWARD, f32(2.8), f32(1))
    expected = np.exp(-2.8 * (1 - np.cos(theta))) / 100
    np.testing.assert_allclose(part(w, b.E_RED), expected, rtol=1e-5)


@pytest.mark.parametrize("seed", range(8))
def test_sources_add_up_to_the_formula(seed: int) -> None:
    w = random_block(seed)
    sources = np.array([[1.2, -0.8, 0.1], [-1.0, 0.4, 0], [0.2, 0.9, -0.3]])
    expected = sum(light_twin(w, source, 2.8, 3.0) for source in sources)
    assert isinstance(expected, np.ndarray)
    lit(w, sources.astype(np.float32), FORWARD, f32(2.8), f32(3))
    for slot, values in zip((b.E_RED, b.E_GREEN, b.SPARK), expected, strict=True):
        np.testing.assert_allclose(part(w, slot), values, rtol=1e-3, atol=6e-5)


def test_the_same_source_twice_is_twice_the_light() -> None:
    once, twice = random_block(0), random_block(0)
    source = np.array([[1, 0.5, 0]], np.float32)
    lit(once, source, FORWARD, f32(2.8), f32(2))
    lit(twice, np.repeat(source, 2, axis=0), FORWARD, f32(2.8), f32(1))
    for slot in (b.E_RED, b.E_GREEN, b.SPARK):
        assert_array_equal(part(once, slot), part(twice, slot))


def test_a_light_behind_the_surface_does_not_break_it() -> None:
    # the half vector of opposite directions has no length
    w = facing_plane(np.full(N, 5.0))
    lit(w, np.array([[0, 0, 10]], np.float32), FORWARD, f32(0), f32(1))
    assert np.isfinite(part(w, b.SPARK)).all()
    assert not part(w, b.E_RED).any()
