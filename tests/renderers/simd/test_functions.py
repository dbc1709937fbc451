"""Functions of vectors against numpy."""

from fractions import Fraction
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from renderers.simd import (
    absolute,
    all_,
    any_,
    as_f32,
    as_i32,
    bits,
    count,
    f32,
    f64,
    floor,
    fma,
    full,
    greatest,
    i32,
    i64,
    lanes,
    least,
    load,
    lowest,
    maximum,
    minimum,
    rank,
    select,
    sqrt,
    store,
)

SPECIAL = [np.nan, np.inf, -np.inf, 0.0, -0.0, 1.5, -1.5, 2.0]
WIDTHS = (4, 8, 16, 32, 64)
COUNT = 256


def pairs(dtype: Any) -> Any:
    a, b = np.meshgrid(np.array(SPECIAL, dtype), np.array(SPECIAL, dtype))
    return np.ascontiguousarray(a.ravel()), np.ascontiguousarray(b.ravel())


def exactly(a: Any, b: Any) -> None:
    """Equal with the sign of zero; any NaN equals any other."""
    np.testing.assert_array_equal(a, b)
    number = ~np.isnan(a)
    np.testing.assert_array_equal(np.signbit(a[number]), np.signbit(b[number]))


@njit
def _lane_by_lane(x: Any, y: Any, out: Any) -> None:
    for i in range(0, 64, 16):
        a = load(x, i, 16)
        b = load(y, i, 16)
        store(out, i, sqrt(a))
        store(out, 64 + i, absolute(a))
        store(out, 128 + i, floor(a))
        store(out, 192 + i, minimum(a, b))
        store(out, 256 + i, maximum(a, b))
        store(out, 320 + i, select(a < b, a, 7))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_reals_lane_by_lane(dtype: Any) -> None:
    x, y = pairs(dtype)
    out = np.zeros(6 * 64, dtype)
    _lane_by_lane(x, y, out)
    root, size, below, least, most, chosen = out.reshape(6, 64)
    with np.errstate(invalid="ignore"):
        exactly(root, np.sqrt(x))
        exactly(size, np.abs(x))
        exactly(below, np.floor(x))
        exactly(least, np.where(x < y, x, y))
        exactly(most, np.where(x > y, x, y))
        exactly(chosen, np.where(x < y, x, dtype(7)))


@njit
def _integers(x: Any, y: Any, out: Any) -> None:
    for i in range(0, 64, 8):
        store(out, i, minimum(load(x, i, 8), load(y, i, 8)))
        store(out, 64 + i, maximum(load(x, i, 8), -3))


@pytest.mark.parametrize("dtype", [np.int32, np.int64])
def test_least_and_greatest_integers(dtype: Any) -> None:
    x, y = np.random.default_rng(1).integers(-9, 9, (2, 64)).astype(dtype)
    out = np.zeros(128, dtype)
    _integers(x, y, out)
    np.testing.assert_array_equal(out[:64], np.minimum(x, y))
    np.testing.assert_array_equal(out[64:], np.maximum(x, -3))


def mask_kernel(width: int) -> Any:
    @njit
    def run(x: Any, out: Any, ranks: Any) -> None:
        m = load(x, 0, width) > 0
        out[0] = bits(m)
        out[1] = count(m)
        out[2] = any_(m)
        out[3] = all_(m)
        store(ranks, 0, rank(m))
        if any_(m):
            out[4] = 1

    return run


@pytest.mark.parametrize("width", WIDTHS)
def test_masks_across_lanes(width: int) -> None:
    rng = np.random.default_rng(width)
    run = mask_kernel(width)
    for x in (
        np.zeros(width, np.int32),
        np.ones(width, np.int32),
        *rng.integers(0, 2, (6, width)).astype(np.int32),
    ):
        out, ranks = np.zeros(5, np.int64), np.zeros(width, np.int32)
        run(x, out, ranks)
        word = sum(int(b) << i for i, b in enumerate(x))
        assert int(out[0]) % 2**64 == word
        assert list(out[1:]) == [x.sum(), x.any(), x.all(), x.any()]
        np.testing.assert_array_equal(ranks, np.cumsum(x) - x)


@njit
def _convert(x: Any, a: Any, b: Any, c: Any, d: Any) -> None:
    for i in range(0, 32, 8):
        v = load(x, i, 8)
        store(a, i, f32(v))
        store(b, i, f64(v))
        store(c, i, i32(v))
        store(d, i, i64(v))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.int64])
def test_conversions(dtype: Any) -> None:
    x = np.random.default_rng(2).uniform(-9e5, 9e5, 32).astype(dtype)
    outs = [np.zeros(32, t) for t in (np.float32, np.float64, np.int32, np.int64)]
    _convert(x, *outs)
    for out in outs:
        np.testing.assert_array_equal(out, x.astype(out.dtype))


@njit
def _made(out: Any, real: Any, truth: Any, scalar: Any) -> None:
    store(out, 0, lanes(16))
    store(out, 16, full(np.int32(-4), 16))
    store(real, 0, full(scalar, 16))
    store(real, 16, f32(full(truth, 16)))
    store(real, 32, f32(lanes(16) < 3))
    store(out, 32, i32(lanes(16) < 5))


def test_vectors_out_of_nothing() -> None:
    out, real = np.zeros(48, np.int32), np.zeros(48, np.float32)
    _made(out, real, True, np.float32(0.3))
    np.testing.assert_array_equal(out[:16], np.arange(16))
    np.testing.assert_array_equal(out[16:32], -4)
    np.testing.assert_array_equal(out[32:], np.arange(16) < 5)
    np.testing.assert_array_equal(real[:16], np.float32(0.3))
    np.testing.assert_array_equal(real[16:32], 1)
    np.testing.assert_array_equal(real[32:], np.arange(16) < 3)


@njit
def _same_bits(x: Any, n: Any, back: Any) -> None:
    store(n, 0, as_i32(load(x, 0, 8)))
    store(back, 0, as_f32(load(n, 0, 8)))


def test_reading_bits_as_another_element() -> None:
    x = np.array(SPECIAL, np.float32)
    n, back = np.zeros(8, np.int32), np.zeros(8, np.float32)
    _same_bits(x, n, back)
    np.testing.assert_array_equal(n, x.view(np.int32))
    np.testing.assert_array_equal(back.view(np.int32), n)


@njit
def _chosen_masks(x: Any, out: Any) -> None:
    a = load(x, 0, 8)
    m = select(a > 2, a > 4, a < 1)
    store(out, 0, i32(m))


def test_masks_are_selected_from() -> None:
    x, out = np.arange(8, dtype=np.int32), np.zeros(8, np.int32)
    _chosen_masks(x, out)
    np.testing.assert_array_equal(out, [1, 0, 0, 0, 0, 1, 1, 1])


def extremes(width: int) -> Any:
    @njit
    def run(x: Any, out: Any) -> None:
        out[0] = least(load(x, 0, width))
        out[1] = greatest(load(x, 0, width))

    return run


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("dtype", [np.float32, np.int32])
def test_extremes_of_all_lanes(width: int, dtype: Any) -> None:
    run, rng = extremes(width), np.random.default_rng(width)
    for _ in range(4):
        x = rng.integers(-1000, 1000, width).astype(dtype)
        out = np.zeros(2, dtype)
        run(x, out)
        assert list(out) == [x.min(), x.max()]


@njit
def _lowest(x: Any, out: Any) -> None:
    for k in range(x.shape[0]):
        out[k] = lowest(x[k])


def test_the_lowest_bit_is_found_wherever_it_is() -> None:
    places = np.arange(64)
    single = np.left_shift(np.int64(1), places)
    rest = np.random.default_rng(1).integers(-(2**63), 2**63, 64)
    x = np.concatenate([single, single | (rest & ~(single - 1)), [0, -1]])
    out = np.zeros(len(x), np.int64)
    _lowest(x, out)
    np.testing.assert_array_equal(out, [*places, *places, 64, 0])


@njit
def _by_fours(x: Any, y: Any, z: Any, out: Any) -> None:
    for i in range(0, COUNT, 4):
        store(out, i, fma(load(x, i, 4), load(y, i, 4), load(z, i, 4)))


@njit
def _by_sixteens(x: Any, y: Any, z: Any, out: Any) -> None:
    for i in range(0, COUNT, 16):
        store(out, i, fma(load(x, i, 16), load(y, i, 16), load(z, i, 16)))


def products(dtype: Any, seed: int) -> Any:
    """Make terms of which the last all but cancels the product of the others."""
    rng = np.random.default_rng(seed)
    x, y = rng.normal(size=(2, COUNT)).astype(dtype)
    return x, y, (-x * y * (1 + rng.normal(size=COUNT) * 1e-6)).astype(dtype)


def rounds_once() -> bool:
    """Say whether code for this machine has products that are added to."""
    arm = llvm.get_process_triple().startswith("aarch64")
    return arm or bool(llvm.get_host_cpu_features().get("fma"))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_product_is_rounded_as_the_processor_can(dtype: Any) -> None:
    """Once: what is given is the nearest number there is to the exact sum."""
    x, y, z = products(dtype, 3)
    out = np.zeros(COUNT, dtype)
    _by_fours(x, y, z, out)
    if not rounds_once():
        np.testing.assert_array_equal(out, x * y + z)
        return
    for a, b, c, found in zip(x, y, z, out, strict=True):
        exact = Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c))
        off = abs(Fraction(float(found)) - exact)
        for beside in (np.nextafter(found, dtype(k)) for k in (-9, 9)):
            assert off <= abs(Fraction(float(beside)) - exact)
    assert np.any(out != x * y + z)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_any_width_has_the_same_bits(dtype: Any) -> None:
    x, y, z = products(dtype, 5)
    out, of_sixteens = np.zeros(COUNT, dtype), np.ones(COUNT, dtype)
    _by_fours(x, y, z, out)
    _by_sixteens(x, y, z, of_sixteens)
    np.testing.assert_array_equal(of_sixteens, out)


def test_vectors_of_two_types_are_refused() -> None:
    x, y, z = products(np.float32, 1)
    with pytest.raises(TypingError, match="fma"):
        _by_fours(x, y.astype(np.float64), z, np.zeros(COUNT))
