import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.lanes import load, store
from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.surface_noise import (
    TILE_SIZE,
    NoiseTile,
    mottle,
    tap_octave,
    vessel,
)
from renderers.shading.noise import noise_tile, stored_tile, tile_from_mm

f32 = np.float32
N = b.N
Floats = NDArray[np.float32]
Points = NDArray[np.float64]


@pytest.fixture(scope="module")
def tile() -> NoiseTile:
    return stored_tile(noise_tile(4.0, 3))


def tapped(
    tile: NoiseTile,
    maps: Floats,
    points: Points,
    eased: bool = False,
    which: int = 0,
) -> Points:
    """Give value and gradient per mm ``(n, 4)`` at up to a block's points, in mm."""
    w = np.zeros(b.SLOTS, np.float32)
    for slot, values in zip((b.PX, b.PY, b.PZ), points.T, strict=True):
        w[slot : slot + len(points)] = values
    origin = (f32(0), f32(0), f32(0))
    tap_octave(w, tile, maps, which, origin, eased, b.LONG)
    channels = [w[b.LONG + k * N :][: len(points)] for k in range(4)]
    return np.stack(channels, axis=-1).astype(np.float64)


def twin(tile: NoiseTile, matrix: Floats, points: Points) -> Points:
    """Tap in float64."""
    n = TILE_SIZE
    values = tile.quads.reshape(n + 1, n + 1, n + 1, 4)[:n, :n, :n] * float(tile.unit)
    m = matrix.astype(np.float64)
    u = points @ m.T
    low = np.floor(u)
    part = u - low
    total = np.zeros((len(points), 4))
    for c in range(8):
        step = np.array([c & 1, c >> 1 & 1, c >> 2])
        i, j, k = ((low.astype(int) + step) % n).T
        weight = np.where(step, part, 1 - part).prod(axis=1)
        total += weight[:, None] * values[k, j, i]
    total[:, 1:] = total[:, 1:] @ m
    return total


def test_a_tap_is_the_trilinear_interpolation(tile: NoiseTile) -> None:
    maps = np.stack([tile_from_mm(1.6, 5.7, 1)])
    points = np.random.default_rng(0).uniform(-90, 90, (50 * N, 3))
    points = points.astype(np.float32).astype(np.float64)
    for some in points.reshape(50, N, 3):
        # float32 places a point 90 mm out to 4e-5 tile voxels
        got, expected = tapped(tile, maps, some), twin(tile, maps[0], some)
        np.testing.assert_allclose(got, expected, atol=2e-3)


def test_it_repeats_with_the_tile(tile: NoiseTile) -> None:
    maps = np.eye(3, dtype=np.float32)[None]
    here = np.random.default_rng(1).integers(-400, 400, (N, 3)) / 8
    here[:4] = (63.5, 0, 0), (0, 63.5, 63.5), (-0.5, -64, 64), (64, 128, -128)
    there = here + np.array([64, -128, 64])
    assert_array_equal(tapped(tile, maps, here), tapped(tile, maps, there))


def test_smooth_taps_agree_on_the_lattice(tile: NoiseTile) -> None:
    maps = np.broadcast_to(np.eye(3, dtype=np.float32), (5, 3, 3)).copy()
    points = np.random.default_rng(2).integers(0, 63, (N, 3)).astype(np.float64)
    plain = tapped(tile, maps, points)
    # without a value in the octaves that bend them, vessels lie where they are
    for which in (3, 4):
        assert_array_equal(tapped(tile, maps, points, True, which), plain)


@njit(error_model="numpy")
def call_vessel(x: Floats, out: Floats) -> None:
    value = load(x, 0, N)
    slope = load(x, N, N)
    radius = load(x, 2 * N, N)
    edge = load(x, 3 * N, N)
    store(out, 0, vessel(value, slope, radius, edge, load(x, 4 * N, N), f32(0.12)))


def cover(
    value: float, slope: float, radius: float, edge: float, footprint: float
) -> float:
    x = np.repeat([value, slope, radius, edge, footprint], N).astype(np.float32)
    out = np.zeros(N, np.float32)
    call_vessel(x, out)
    return float(out[0])


def test_a_vessel_is_as_wide_as_its_radius_wherever_the_noise_is_flat() -> None:
    for slope in (0.2, 1.0, 5.0):
        for offset, inside in ((0.03, True), (0.05, False)):
            got = cover(offset * slope, slope, 0.042, 1e-4, 1e-5)
            assert bool(got > 0.99) is inside


@given(
    value=st.floats(-2, 2),
    slope=st.floats(0.01, 5),
    radius=st.floats(-0.03, 0.1),
    foot=st.floats(0.003, 2),
)
def test_cover_is_the_formula(
    value: float, slope: float, radius: float, foot: float
) -> None:
    edge = 0.55 * radius + 0.02
    soft = max(edge, 0.7 * foot)
    t = min(max(((abs(value) / slope - radius) / soft + 1) / 2, 0), 1)
    expected = (1 - t * t * (3 - 2 * t)) * min(1, radius / (0.7 * foot))
    if abs(slope - 0.12) > 1e-6:
        got = cover(value, slope, radius, edge, foot)
        wanted = expected if radius > 0 and slope > 0.12 else 0
        assert got == pytest.approx(wanted, abs=2e-5)


def test_a_vessel_thinner_than_a_pixel_fades() -> None:
    assert cover(0, 1, 0.04, 0.02, 0.001) == 1
    # half the pixel, half the strength: its total stays the same
    wide, wider = (cover(0, 1, 0.04, 0.02, foot) for foot in (0.8, 1.6))
    assert wide / wider == pytest.approx(2, rel=0.1)
    assert cover(0, 0.1, 0.04, 0.02, 0.1) == 0
    assert cover(0, 1, -0.01, 0.02, 0.1) == 0


def test_mottle_varies_the_logarithm_of_blood() -> None:
    rng = np.random.default_rng(5)
    w = np.zeros(b.SLOTS, np.float32)
    long, middle, short = (rng.normal(size=N).astype(np.float32) for _ in range(3))
    for slot, values in ((b.LONG, long), (b.MIDDLE, middle), (b.SHORT, short)):
        w[slot : slot + N] = values
    w[b.NZ : b.NZ + N] = 1
    w[b.FOOT : b.FOOT + N] = 0.01
    for slot in (b.LARGE, b.SMALL):  # far from any vessel
        w[slot : slot + N] = 3
        w[slot + N : slot + 2 * N] = 1
    for full, exponent in (
        (False, 0.26 * long + 0.11 * middle),
        (True, 0.26 * long + 0.11 * middle + 0.07 * short),
    ):
        w[b.CODE : b.CODE + N] = 90
        mottle(w, full)
        expected = 90 * np.exp(exponent / 2)
        np.testing.assert_allclose(w[b.CODE : b.CODE + N], expected, rtol=1e-5)


def test_vessels_add_blood_except_in_skin() -> None:
    w = np.zeros(b.SLOTS, np.float32)
    w[b.NZ : b.NZ + N] = 1
    w[b.FOOT : b.FOOT + N] = 0.001
    w[b.LARGE + N : b.LARGE + 2 * N] = 1  # on the zero curve, slope 1
    w[b.SKIN : b.SKIN + N : 2] = 1
    w[b.CODE : b.CODE + N] = 90
    # wide enough to have a core; of mottle, what belongs to it
    w[b.LONG : b.LONG + N] = 2
    mottle(w, False)
    before = (90 / 255) ** 2 * math.exp(0.52)
    after = before + 0.6 * (0.1 + 1.6 * before)
    np.testing.assert_allclose(
        w[b.CODE : b.CODE + N : 2], 255 * math.sqrt(before), rtol=1e-5
    )
    np.testing.assert_allclose(
        w[b.CODE + 1 : b.CODE + N : 2], 255 * math.sqrt(after), rtol=1e-5
    )
