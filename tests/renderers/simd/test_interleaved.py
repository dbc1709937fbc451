"""Columns of interleaved memory."""

from typing import Any

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError
from numpy.testing import assert_array_equal

from renderers.simd import (
    copy_rows4,
    gather_pairs,
    load,
    rows_alike,
    store,
    swapped,
    unzip3,
    zip3,
)

WIDTHS = (4, 8, 16, 32)


def shuffled(by: Any, width: int) -> Any:
    @njit
    def run(x: Any, out: Any) -> None:
        a, b, c = by(
            load(x, 0, width), load(x, width, width), load(x, 2 * width, width)
        )
        store(out, 0, a)
        store(out, width, b)
        store(out, 2 * width, c)

    return run


def paired(width: int) -> Any:
    @njit
    def run(numbers: Any, index: Any, out: Any) -> None:
        store(out, 0, gather_pairs(numbers, load(index, 0, width)))

    return run


@pytest.mark.parametrize("element", [np.float32, np.int32])
@pytest.mark.parametrize("width", WIDTHS)
def test_triples_are_sorted_and_mixed_again(width: int, element: type) -> None:
    x: Any = np.arange(3 * width, dtype=element)
    out, back = np.zeros_like(x), np.zeros_like(x)
    shuffled(unzip3, width)(x, out)
    assert_array_equal(out.reshape(3, width), x.reshape(width, 3).T)
    shuffled(zip3, width)(out, back)
    assert_array_equal(back, x)


@pytest.mark.parametrize("stored", [np.uint16, np.int16])
@pytest.mark.parametrize("width", WIDTHS)
def test_pairs_are_two_neighbours(width: int, stored: type) -> None:
    rng = np.random.default_rng(width)
    words = rng.integers(0, 65536, 200).astype(np.uint16)
    index = rng.integers(0, 199, width).astype(np.int32)
    index[:2] = 0, 198
    out = np.zeros(width, np.int32)
    paired(width)(words.view(stored), index, out)
    first, second = words[index].astype(np.int64), words[index + 1].astype(np.int64)
    assert_array_equal(out.view(np.uint32), first + 65536 * second)


@pytest.mark.parametrize("rows", [1, 2, 4])
def test_rows_are_alike(rows: int) -> None:
    @njit
    def alike(x: Any, out: Any) -> None:
        store(out, 0, rows_alike(load(x, 0, 4), rows))

    x = np.array([3, 1, 4, 1], np.float32)
    out = np.zeros(4 * rows, np.float32)
    alike(x, out)
    assert_array_equal(out, np.tile(x, rows))


@pytest.mark.parametrize("step", [1, 2, 4])
def test_lanes_are_swapped_with_those_a_step_away(step: int) -> None:
    @njit
    def swap(x: Any, out: Any) -> None:
        store(out, 0, swapped(load(x, 0, 8), step))

    x = np.arange(8, dtype=np.int64)
    out = np.zeros_like(x)
    swap(x, out)
    assert_array_equal(out, x ^ step)


@pytest.mark.parametrize("dtype", [np.float32, np.int32])
@pytest.mark.parametrize("width", WIDTHS)
def test_rows_are_copied(width: int, dtype: Any) -> None:
    @njit
    def copy(to: Any, places: Any, x: Any, index: Any) -> None:
        copy_rows4(to, load(places, 0, width), x, load(index, 0, width))

    generator = np.random.default_rng(width)
    x = generator.integers(0, 1000, (50, 4)).astype(dtype)
    index = generator.integers(0, 50, width).astype(np.int32)
    places = generator.permutation(40)[:width].astype(np.int32)
    to = np.zeros((40, 4), dtype)
    copy(to, places, x, index)
    wanted = np.zeros_like(to)
    wanted[places] = x[index]
    assert_array_equal(to, wanted)


def test_what_does_not_fit_together_is_refused() -> None:
    """Pairs of 32 bits; lanes beyond the last; rows of other kinds of numbers."""

    @njit
    def swap(x: Any) -> None:
        store(x, 0, swapped(load(x, 0, 4), 4))

    @njit
    def copy(to: Any, x: Any, index: Any) -> None:
        copy_rows4(to, load(index, 0, 4), x, load(index, 0, 4))

    four, rows = np.zeros(4, np.int32), np.zeros((4, 4), np.float32)
    for run, given in (
        (paired(4), (np.zeros(9, np.int32), four, four)),
        (swap, (np.zeros(4, np.int64),)),
        (copy, (rows, np.zeros((4, 4), np.int32), four)),
    ):
        with pytest.raises(TypingError):
            run(*given)
