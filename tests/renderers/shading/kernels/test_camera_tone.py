import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.lanes import load, store
from renderers.scene import srgb_from_linear
from renderers.shading.kernels.camera_tone import (
    W,
    colour_row,
    contrast_row,
    encode_row,
    exp2,
    log2,
)

f32 = np.float32
LANES = 16
Floats = NDArray[np.float32]
BLACK = np.zeros((1, 3 * W), np.float32)
CLEAR = np.ones((1, W), np.float32)
NO_GRAIN = np.zeros((3, 1, 1 + W), np.float32)


@njit(error_model="numpy")
def powers(values: Floats, power: Floats, logarithm: Floats) -> None:
    store(power, 0, exp2(load(values, 0, LANES)))
    store(logarithm, 0, log2(load(values, 0, LANES)))


def exp2_and_log2(values: Floats) -> tuple[Floats, Floats]:
    power, logarithm = np.empty(LANES, np.float32), np.empty(LANES, np.float32)
    powers(values, power, logarithm)
    return power, logarithm


def all_lanes(value: float) -> Floats:
    return np.full(LANES, value, np.float32)


def row_of(values: NDArray[np.floating]) -> Floats:
    """Give (3, W) as a row of planes."""
    return values.astype(np.float32).reshape(1, -1)


def codes_of(values: Floats, edge: Floats = CLEAR) -> NDArray[np.uint8]:
    codes = np.zeros((3, W), np.uint8)
    encode_row(row_of(values), W, 0, W, NO_GRAIN, 0, 0, f32(0), f32(0), edge, 0, codes)
    return codes


@given(x=st.floats(-100, 100, width=32))
def test_exp2_is_exp2(x: float) -> None:
    got, _ = exp2_and_log2(all_lanes(x))
    assert np.all(got == got[0])
    assert got[0] == pytest.approx(2.0**x, rel=5e-7)


@given(x=st.floats(f32(1e-30).item(), f32(1e30).item(), width=32))
def test_log2_is_log2(x: float) -> None:
    _, got = exp2_and_log2(all_lanes(x))
    assert np.all(got == got[0])
    assert got[0] == pytest.approx(math.log2(x), rel=1e-6, abs=1e-6)


def test_logarithms_of_powers_of_two_are_exact() -> None:
    k = np.arange(-8, 8)
    _, got = exp2_and_log2((2.0**k).astype(np.float32))
    assert_array_equal(got, k)


def test_what_has_no_logarithm_stays_finite() -> None:
    assert exp2_and_log2(all_lanes(0.0))[1][0] == -127
    assert exp2_and_log2(all_lanes(-1e9))[0][0] == pytest.approx(2.0**-126)


@given(seed=st.integers(0, 1000))
def test_codes_are_srgb_under_the_stop(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = (rng.random((3, W)) ** 3).astype(np.float32)
    edge = rng.random((1, W)).astype(np.float32)
    exact = 255 * srgb_from_linear((values * edge).astype(np.float64))
    assert np.abs(codes_of(values, edge) - exact).max() <= 0.501


def test_codes_end_at_black_and_white() -> None:
    values = np.zeros((3, W), np.float32)
    values[1, :6] = [-1, -1e-9, 0, 1, 1.5, 1e9]
    codes = codes_of(values)
    assert_array_equal(codes[1, :6], [0, 0, 0, 255, 255, 255])
    assert not codes[0].any()


def test_grain_is_periodic_and_grows_with_light() -> None:
    side = 5
    tile = np.random.default_rng(0).standard_normal((3, side, side)).astype(np.float32)
    grain = np.concatenate([tile] * (2 + W // side), axis=2)[..., : side + W]
    grain = np.ascontiguousarray(grain)
    values = np.full((3, 2 * W), 0.2, np.float32)
    values[:, W:] = 0.6
    codes = np.zeros((3, 2 * W), np.uint8)
    noise2, floor = f32(0.02**2), f32(0.15)
    encode_row(
        row_of(values), 2 * W, 0, 2 * W, grain, 3, 7, noise2, floor,
        np.ones((1, 2 * W), np.float32), 0, codes,
    )  # fmt: skip
    speck = tile[:, 3, (np.arange(2 * W) + 7) % side]
    expected = values + speck * 0.02 * np.sqrt(0.15 + values)
    exact = 255 * srgb_from_linear(expected.astype(np.float64))
    assert np.abs(codes - exact).max() <= 0.51


def test_contrast_turns_about_its_pivot_after_the_lens() -> None:
    rng = np.random.default_rng(2)
    values = np.geomspace(1e-5, 30, 3 * W).reshape(3, W)
    values[0, 0] = 0
    dim = rng.random((2, W)).astype(np.float32)
    pivot = f32(-0.3 * math.log2(0.18))
    line = row_of(values)
    contrast_row(line, W, 0, W, dim, W, f32(0), f32(1.3), pivot)
    expected = 0.18 * (values * dim[1] / 0.18) ** 1.3
    np.testing.assert_allclose(line.reshape(3, W), expected, rtol=1e-5)
    assert line[0, 0] == 0
    line = row_of(values)
    contrast_row(line, W, 0, W, dim, 0, f32(0.02), f32(1), f32(0))
    np.testing.assert_allclose(line.reshape(3, W), values * dim[0] + 0.02, rtol=1e-6)


def test_colours_are_saturated_about_grey_and_bent_with_their_hue() -> None:
    rgb = np.random.default_rng(4).gamma(1, 0.5, (3, W)).astype(np.float32)
    flat, bent = row_of(rgb), row_of(rgb)
    colour_row(flat, W, 0, W, f32(1.15), f32(1e6), f32(0.4))
    colour_row(bent, W, 0, W, f32(1.15), f32(0.55), f32(0.4))
    flat, bent = flat.reshape(3, W), bent.reshape(3, W)
    grey = np.array([0.2126, 0.7152, 0.0722]) @ rgb
    expected = np.maximum(grey + 1.15 * (rgb - grey), 0)
    np.testing.assert_allclose(flat, expected, atol=1e-6)

    def curve(c: NDArray[np.float64]) -> NDArray[np.float64]:
        over = np.maximum(c - 0.55, 0) / 0.45
        return np.where(c > 0.55, 0.55 + 0.45 * over / (1 + over), c)

    top = expected.max(axis=0)
    keep = 0.4 * np.minimum(2 * (top - expected.min(axis=0)) / top, 1)
    mixed = keep * expected * curve(top) / top + (1 - keep) * curve(expected)
    np.testing.assert_allclose(bent, mixed, atol=1e-6)
    assert bent.max() < 1
    dark = top <= 0.55
    assert dark.any()
    assert_array_equal(bent[:, dark], flat[:, dark])
