"""Loads and stores, in runs and lane by lane."""

from typing import Any

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from renderers.simd import (
    gather,
    gather_u8,
    i64,
    lanes,
    load,
    load_where,
    prefetch,
    spread,
    store,
    store_where,
)

WIDTHS = (4, 8, 16, 32)


def copier(width: int) -> Any:
    @njit
    def run(x: Any, out: Any) -> None:
        store(out, 5, load(x, 3, width))

    return run


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize(
    "dtype", [np.float32, np.float64, np.int32, np.int64, np.uint8, np.int16, np.uint16]
)
def test_runs_start_anywhere_and_touch_nothing_else(width: int, dtype: Any) -> None:
    info = np.iinfo(dtype) if np.dtype(dtype).kind in "iu" else None
    low, high = (info.min, info.max) if info else (-(10**6), 10**6)
    x = np.random.default_rng(1).integers(low, high, 40).astype(dtype)
    out = np.full(48, 77, dtype)
    copier(width)(x, out)
    wanted = np.full(48, 77, dtype)
    wanted[5 : 5 + width] = x[3 : 3 + width]
    np.testing.assert_array_equal(out, wanted)


@njit
def _small(x: Any, out: Any, cut: Any) -> None:
    v = load(x, 0, 8)
    store(out, 0, v)
    store(cut, 0, v + 256)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16])
def test_small_integers_are_widened_and_cut_off(dtype: Any) -> None:
    info = np.iinfo(dtype)
    x = np.linspace(info.min, info.max, 8).astype(dtype)
    out, cut = np.zeros(8, np.int32), np.zeros(8, dtype)
    _small(x, out, cut)
    np.testing.assert_array_equal(out, x)
    np.testing.assert_array_equal(cut, (x.astype(np.int32) + 256).astype(dtype))


@njit
def _where(x: Any, out: Any, at: Any, n: Any) -> None:
    m = lanes(16) < n
    store_where(out, at, load_where(x, at, m), m)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.int64])
@pytest.mark.parametrize("n", [0, 1, 7, 16])
def test_runs_that_end_early(dtype: Any, n: int) -> None:
    x = np.arange(1, 4 + n, dtype=dtype)
    out = np.zeros(len(x), dtype)
    _where(x, out, 3, n)
    np.testing.assert_array_equal(out, np.where(np.arange(len(x)) < 3, 0, x))


@njit
def _gathered(x: Any, index: Any, out: Any, wide: Any) -> None:
    for i in range(0, 64, 16):
        n = load(index, i, 16)
        m = n >= 0
        store(out, i, gather(x, n, m))
        store(wide, i, gather(x, i64(n), m))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.int64])
def test_gathers(dtype: Any) -> None:
    rng = np.random.default_rng(4)
    x = rng.normal(0, 1e4, (7, 11)).astype(dtype)
    index = rng.integers(0, 77, 64).astype(np.int32)
    index[rng.random(64) < 0.3] = -(2**30)
    out, wide = np.ones(64, dtype), np.ones(64, dtype)
    _gathered(x, index, out, wide)
    wanted = np.where(index < 0, 0, x.ravel()[np.maximum(index, 0)])
    np.testing.assert_array_equal(out, wanted)
    np.testing.assert_array_equal(wide, wanted)


@njit
def _bytes(x: Any, index: Any, out: Any) -> None:
    n = load(index, 0, 32)
    store(out, 0, gather_u8(x, n, n >= 0))


def test_bytes_are_gathered() -> None:
    rng = np.random.default_rng(4)
    x = rng.integers(0, 256, 103).astype(np.uint8)
    index = rng.integers(-20, 100, 32).astype(np.int32)
    out = np.zeros(32, np.int32)
    _bytes(x, index, out)
    np.testing.assert_array_equal(out, np.where(index < 0, 0, x[index]))


def test_arrays_with_gaps_are_turned_down() -> None:
    with pytest.raises(TypingError):
        copier(4)(np.zeros((8, 8), np.float32)[:, :4], np.zeros(16, np.float32))


@njit
def _ahead(x: Any, index: Any) -> Any:
    prefetch(x, index)
    return x[0]


@pytest.mark.parametrize("index", [0, 7, 1 << 40, -(1 << 40)])
def test_asking_for_memory_never_fails(index: int) -> None:
    for dtype in (np.float32, np.int64, np.uint8):
        assert _ahead(np.full(8, 3, dtype), index) == 3


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.int64])
def test_one_element_is_spread_over_all_lanes(dtype: Any) -> None:
    @njit
    def run(x: Any, index: Any, out: Any) -> None:
        store(out, 0, spread(x, index, 8))

    x = np.arange(20).reshape(4, 5).astype(dtype)
    out = np.zeros(8, dtype)
    run(x, 13, out)
    np.testing.assert_array_equal(out, np.full(8, 13, dtype))


def test_lines_of_unlike_arrays_are_asked_for_by_one_kernel() -> None:
    @njit
    def run(x: Any, n: Any) -> Any:
        prefetch(x, 0)
        prefetch(n, 10**6)
        return x[0] + n[0]

    assert run(np.ones(4, np.float32), np.ones(4, np.int32)) == 2
