import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.bump_normals import bump

f32 = np.float32
N = b.N


def scratch() -> NDArray[np.float32]:
    """Give a block of random normals and gradients, fully resolved."""
    rng = np.random.default_rng(4)
    w = np.zeros(b.SLOTS, np.float32)
    normal = rng.normal(size=(3, N))
    w[b.NX : b.NZ + N] = (normal / np.linalg.norm(normal, axis=0)).reshape(-1)
    for slot in (b.LONG, b.MIDDLE, b.SHORT):
        w[slot + N : slot + 4 * N] = rng.normal(size=3 * N)
    w[b.RELIEF : b.RELIEF + N] = 1
    w[b.FOOT : b.FOOT + N] = 0.01
    w[b.ROUGH : b.ROUGH + N] = 0.002
    return w


def vector(w: NDArray[np.float32], slot: int) -> NDArray[np.float64]:
    return w[slot : slot + 3 * N].reshape(3, N).astype(np.float64)


def test_bent_normals_follow_the_formula() -> None:
    w = scratch()
    bump(w, True)
    n = vector(w, b.NX)
    wave = np.array([6.5, 1.6, 0.55]) / (2 * np.pi)
    for slot, slopes in ((b.HX, (0.06, 0.09, 0.04)), (b.TX, (0, 0.06, 0.04))):
        bend = sum(
            s * k * vector(w, octave + N)
            for s, k, octave in zip(
                slopes, wave, (b.LONG, b.MIDDLE, b.SHORT), strict=True
            )
        )
        bend = bend - (bend * n).sum(axis=0) * n
        expected = (n - bend) / np.linalg.norm(n - bend, axis=0)
        np.testing.assert_allclose(vector(w, slot), expected, atol=1e-6)
    # all waves resolved: no roughness added
    assert_array_equal(w[b.A2 : b.A2 + N], f32(0.002))


def test_without_relief_the_surface_is_bare() -> None:
    w = scratch()
    w[b.RELIEF : b.RELIEF + N] = 0
    bump(w, True)
    for slot in (b.HX, b.TX):
        np.testing.assert_allclose(vector(w, slot), vector(w, b.NX), atol=1e-6)
    assert_array_equal(w[b.A2 : b.A2 + N], f32(0.002))


def test_waves_finer_than_a_pixel_become_roughness() -> None:
    w = scratch()
    w[b.FOOT : b.FOOT + N] = 2.0
    bump(w, True)
    rough = 0.002 + 2 * (0.09**2 + 0.04**2)
    np.testing.assert_allclose(w[b.A2 : b.A2 + N], rough, rtol=1e-5)
    np.testing.assert_allclose(vector(w, b.TX), vector(w, b.NX), atol=1e-6)


def test_skin_is_never_shiny() -> None:
    w = scratch()
    w[b.SKIN : b.SKIN + N] = 1
    bump(w, True)
    assert float(w[b.A2 : b.A2 + N].min()) == pytest.approx(0.12)


def test_without_the_short_octave_its_ripples_are_roughness() -> None:
    with_it, without = scratch(), scratch()
    with_it[b.SHORT : b.SHORT + 4 * N] = 0
    bump(with_it, True)
    bump(without, False)
    for slot in (b.HX, b.TX):
        assert_array_equal(vector(without, slot), vector(with_it, slot))
    added = without[b.A2 : b.A2 + N] - with_it[b.A2 : b.A2 + N]
    np.testing.assert_allclose(added, 2 * 0.04**2, rtol=1e-4)
