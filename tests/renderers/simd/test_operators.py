"""Every operator against numpy, for all widths, special values among them."""

import operator
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from renderers.simd import full, load, select, store

WIDTHS = (4, 8, 16, 32)
COUNT = 64
REALS = (np.float32, np.float64)
INTEGERS = (np.int32, np.int64)


def numbers(dtype: Any, seed: int) -> NDArray[Any]:
    rng = np.random.default_rng(seed)
    if dtype in INTEGERS:
        x = rng.integers(-(2**31), 2**31 - 1, COUNT).astype(dtype)
        x[:4] = 0, -1, 1, -(2**31)
        return x
    x = rng.normal(0, 10, COUNT).astype(dtype)
    special = [np.nan, np.inf, -np.inf, 0.0, -0.0, 1.0]
    first, second = np.meshgrid(special, special)
    x[:36] = (first if seed == 1 else second).ravel()
    return x


def same(a: NDArray[Any], b: NDArray[Any]) -> bool:
    """Equal bits; any NaN equals any other."""
    nan = np.isnan(a) & np.isnan(b) if a.dtype.kind == "f" else np.zeros(len(a), bool)
    bits = a.view(f"u{a.itemsize}") == b.view(f"u{b.itemsize}")
    return a.dtype == b.dtype and bool(np.all(bits | nan))


# All operators of a kind in one function: compiling each alone takes three times as
# long.


@cache
def reals(width: int) -> Callable[..., None]:
    def run(x: Any, y: Any, out: Any) -> None:
        for i in range(0, COUNT, width):
            a, b = load(x, i, width), load(y, i, width)
            store(out[0], i, a + b)
            store(out[1], i, a - b)
            store(out[2], i, a * b)
            store(out[3], i, a / b)

    compiled: Callable[..., None] = njit(run)
    return compiled


@cache
def integers(width: int) -> Callable[..., None]:
    def run(x: Any, y: Any, out: Any) -> None:
        for i in range(0, COUNT, width):
            a, b = load(x, i, width), load(y, i, width)
            store(out[0], i, a + b)
            store(out[1], i, a - b)
            store(out[2], i, a * b)
            store(out[3], i, a & b)
            store(out[4], i, a | b)
            store(out[5], i, a ^ b)

    compiled: Callable[..., None] = njit(run)
    return compiled


@cache
def comparisons(width: int) -> Callable[..., None]:
    def run(x: Any, y: Any, out: Any) -> None:
        one = full(np.int32(1), width)
        for i in range(0, COUNT, width):
            a, b = load(x, i, width), load(y, i, width)
            store(out[0], i, select(a < b, one, 0))
            store(out[1], i, select(a <= b, one, 0))
            store(out[2], i, select(a > b, one, 0))
            store(out[3], i, select(a >= b, one, 0))
            store(out[4], i, select(a == b, one, 0))
            store(out[5], i, select(a != b, one, 0))

    compiled: Callable[..., None] = njit(run)
    return compiled


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("dtype", REALS + INTEGERS)
def test_arithmetic(width: int, dtype: Any) -> None:
    x, y = numbers(dtype, 1), numbers(dtype, 2)
    names = ["add", "sub", "mul"]
    names += ["truediv"] if dtype in REALS else ["and_", "or_", "xor"]
    out = np.zeros((len(names), COUNT), dtype)
    (reals if dtype in REALS else integers)(width)(x, y, out)
    for found, name in zip(out, names, strict=True):
        with np.errstate(all="ignore"):
            assert same(found, getattr(operator, name)(x, y)), name


@njit
def _in_place(x: Any, y: Any, out: Any, width: Any) -> None:
    a = load(x, 0, 8)
    b = load(y, 0, 8)
    a += b
    a *= b
    a -= 2
    store(out, 0, a)


@pytest.mark.parametrize("dtype", REALS + INTEGERS)
def test_in_place_forms(dtype: Any) -> None:
    x, y = numbers(dtype, 1), numbers(dtype, 2)
    out = np.zeros(COUNT, dtype)
    _in_place(x, y, out, 8)
    with np.errstate(all="ignore"):
        wanted = (x[:8] + y[:8]) * y[:8] - dtype(2)
    assert same(out[:8], wanted)


@njit
def _in_place_masks(x: Any, y: Any, out: Any) -> None:
    zero = x[0] - x[0]
    a = load(x, 0, 8)
    b = load(y, 0, 8)
    m = a > zero
    m &= b > zero
    m |= a == b
    m ^= b < a
    store(out, 0, select(~m, full(np.int32(1), 8), 0))
    n = load(out, 0, 8)
    n <<= 4
    n |= 3
    n >>= 1
    n &= 13
    n ^= 5
    store(out, 8, n)


def test_masks_and_integers_in_place() -> None:
    x, y = np.random.default_rng(3).integers(-3, 3, (2, 8)).astype(np.float32)
    x[0] = 1
    out = np.zeros(16, np.int32)
    _in_place_masks(x, y, out)
    mask = (((x > 0) & (y > 0)) | (x == y)) ^ (y < x)
    np.testing.assert_array_equal(out[:8], ~mask)
    np.testing.assert_array_equal(out[8:], ((out[:8] << 4 | 3) >> 1 & 13) ^ 5)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("dtype", REALS + INTEGERS)
def test_comparisons_follow_ieee_754(width: int, dtype: Any) -> None:
    x, y = numbers(dtype, 1), numbers(dtype, 2)
    names = ("lt", "le", "gt", "ge", "eq", "ne")
    out = np.full((len(names), COUNT), 7, np.int32)
    comparisons(width)(x, y, out)
    for found, name in zip(out, names, strict=True):
        np.testing.assert_array_equal(found, getattr(operator, name)(x, y), name)


@njit
def _unary(x: Any, n: Any, out: Any, inverted: Any) -> None:
    for i in range(0, COUNT, 8):
        store(out, i, -load(x, i, 8))
        store(inverted, i, ~load(n, i, 8))
        store(n, i, -load(n, i, 8))


@pytest.mark.parametrize("dtype", REALS)
def test_signs_and_inverses(dtype: Any) -> None:
    x, n = numbers(dtype, 1), numbers(np.int32, 1)
    before, out, inverted = n.copy(), np.zeros_like(x), np.zeros_like(n)
    _unary(x, n, out, inverted)
    assert same(out, -x), "the sign of zero turns as well"
    np.testing.assert_array_equal(inverted, ~before)
    np.testing.assert_array_equal(n, -before)


@njit
def _shifts(n: Any, left: Any, right: Any) -> None:
    for i in range(0, COUNT, 4):
        store(left, i, load(n, i, 4) << 5)
        store(right, i, load(n, i, 4) >> 3)


@pytest.mark.parametrize("dtype", INTEGERS)
def test_shifts(dtype: Any) -> None:
    n = numbers(dtype, 1)
    left, right = np.zeros_like(n), np.zeros_like(n)
    _shifts(n, left, right)
    np.testing.assert_array_equal(left, n << 5)
    np.testing.assert_array_equal(right, n >> 3)


@njit
def _numbers(x: Any, out: Any) -> None:
    a = load(x, 0, 8)
    store(out, 0, 1.0 / (a + 0.1) * 3 - np.float32(0.7))


@pytest.mark.parametrize("dtype", REALS)
def test_a_number_takes_the_vectors_element(dtype: Any) -> None:
    x = numbers(dtype, 1)
    x[:8] = np.arange(8)
    out = np.zeros(8, dtype)
    _numbers(x, out)
    last = dtype(np.float32(0.7))
    assert same(out, dtype(1) / (x[:8] + dtype(0.1)) * dtype(3) - last)


@njit
def _rounded_twice(x: Any, y: Any, z: Any, out: Any) -> None:
    for i in range(0, COUNT, 16):
        store(out, i, load(x, i, 16) * load(y, i, 16) + load(z, i, 16))


def test_products_and_sums_are_not_fused() -> None:
    rng = np.random.default_rng(5)
    x, y = rng.normal(size=(2, COUNT)).astype(np.float32)
    z = -x * y
    out = np.ones(COUNT, np.float32)
    _rounded_twice(x, y, z, out)
    assert not out.any()
