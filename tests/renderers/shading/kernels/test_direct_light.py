import numpy as np
from numpy.typing import NDArray

from renderers.shading.capsules import COLUMNS
from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.direct_light import light

f32 = np.float32
N = b.N
FORWARD = np.array([0, 0, 1], np.float32)
EYE = np.zeros((1, 3), np.float32)
NO_RODS = np.zeros((0, COLUMNS), np.float32)


def lit(w: NDArray[np.float32]) -> None:
    """Light a block from the eye, with nothing in the way."""
    light(w, EYE, np.zeros_like(EYE), NO_RODS, FORWARD, f32(2.8), f32(1))


def facing_plane(depth_mm: NDArray[np.float64]) -> NDArray[np.float32]:
    """Put N pixels on the view axis, facing the eye, without film or scattering."""
    w = np.zeros(b.SLOTS, np.float32)
    w[b.PZ : b.PZ + N] = depth_mm
    w[b.DZ : b.DZ + N] = 1
    for slot in (b.NZ, b.TZ, b.HZ):
        w[slot : slot + N] = -1
    w[b.A2 : b.A2 + N] = 0.1
    return w


def part(w: NDArray[np.float32], slot: int) -> NDArray[np.float64]:
    return w[slot : slot + N].astype(np.float64)


def test_light_falls_with_the_square_of_the_distance() -> None:
    depth = np.linspace(1, 60, N)
    w = facing_plane(depth)
    lit(w)
    for slot in (b.E_RED, b.E_GREEN):
        np.testing.assert_allclose(part(w, slot) * depth**2, 1, rtol=5e-6)


def test_near_the_fibres_light_does_not_grow_without_bound() -> None:
    w = facing_plane(np.linspace(0.2, 0.7, N))
    lit(w)
    np.testing.assert_allclose(part(w, b.E_RED), 1 / 0.6, rtol=1e-4)


def test_the_spot_darkens_by_its_law() -> None:
    theta = np.linspace(0, 1.2, N)
    w = facing_plane(np.ones(N))
    w[b.PX : b.PX + N] = 10 * np.sin(theta)
    w[b.PZ : b.PZ + N] = 10 * np.cos(theta)
    w[b.NX : b.NX + N] = -np.sin(theta)
    w[b.NZ : b.NZ + N] = -np.cos(theta)
    lit(w)
    expected = np.exp(-2.8 * (1 - np.cos(theta))) / 100
    np.testing.assert_allclose(part(w, b.E_RED), expected, rtol=1e-5)
