import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.lanes.kernels import (
    exp_negative,
    gather_pairs,
    resolved,
    rows_alike,
    smooth,
    unzip3,
    zip3,
)
from renderers.simd import load, store

f32 = np.float32
Floats = NDArray[np.float32]
W = 16


@njit(error_model="numpy")
def call_unzip(x: Floats, out: Floats) -> None:
    a, b, c = unzip3(load(x, 0, W), load(x, W, W), load(x, 2 * W, W))
    store(out, 0, a)
    store(out, W, b)
    store(out, 2 * W, c)


@njit(error_model="numpy")
def call_zip(x: Floats, out: Floats) -> None:
    a, b, c = zip3(load(x, 0, W), load(x, W, W), load(x, 2 * W, W))
    store(out, 0, a)
    store(out, W, b)
    store(out, 2 * W, c)


@njit(error_model="numpy")
def call_pairs(
    pairs: NDArray[np.uint16], index: NDArray[np.int32], out: NDArray[np.int32]
) -> None:
    store(out, 0, gather_pairs(pairs, load(index, 0, W)))


@njit(error_model="numpy")
def call_alike(x: Floats, out: Floats) -> None:
    store(out, 0, rows_alike(load(x, 0, 4), 4))


@njit(error_model="numpy")
def call_functions(x: Floats, out: Floats) -> None:
    v = load(x, 0, W)
    store(out, 0, exp_negative(v))
    store(out, W, smooth(v))
    store(out, 2 * W, resolved(v, f32(0.5)))


def test_triples_are_sorted_and_mixed_again() -> None:
    x = np.arange(3 * W, dtype=np.float32)
    out, back = np.zeros_like(x), np.zeros_like(x)
    call_unzip(x, out)
    assert_array_equal(out.reshape(3, W), x.reshape(W, 3).T)
    call_zip(out, back)
    assert_array_equal(back, x)


def test_pairs_are_two_neighbours() -> None:
    rng = np.random.default_rng(0)
    pairs = rng.integers(0, 65536, 200).astype(np.uint16)
    index = rng.integers(0, 199, W).astype(np.int32)
    index[:2] = 0, 198
    out = np.zeros(W, np.int32)
    call_pairs(pairs, index, out)
    first, second = pairs[index].astype(np.int64), pairs[index + 1].astype(np.int64)
    assert_array_equal(out.view(np.uint32), first + 65536 * second)


def test_rows_are_alike() -> None:
    x = np.array([3, 1, 4, 1], np.float32)
    out = np.zeros(16, np.float32)
    call_alike(x, out)
    assert_array_equal(out, np.tile(x, 4))


@given(x=st.floats(-87, 0, width=32))
def test_exp_is_exp(x: float) -> None:
    out = np.zeros(3 * W, np.float32)
    call_functions(np.full(W, x, np.float32), out)
    assert out[0] == pytest.approx(math.exp(x), rel=1e-6 * (1 - x / 10), abs=1e-37)


def test_a_wave_fades_between_a_quarter_and_half_of_its_length() -> None:
    # wavelength 2
    x = np.linspace(0, 1.5, W).astype(np.float32)
    out = np.zeros(3 * W, np.float32)
    call_functions(x, out)
    faded = out[2 * W :]
    assert np.all(np.diff(faded) <= 0)
    assert np.all(faded[x <= 0.5] == 1)
    assert np.all(faded[x >= 1] == 0)
    np.testing.assert_allclose(np.interp(0.75, x, faded), 0.5, atol=0.01)
    np.testing.assert_allclose(out[W : 2 * W], x * x * (3 - 2 * x), rtol=1e-5)
