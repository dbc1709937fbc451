"""Rows of four, per lane."""

from typing import Any

import numpy as np
import pytest
from numba import njit

from renderers.simd import (
    load,
    load_triples,
    put_rows4,
    row,
    rows4,
    rows8,
    store,
    store_groups,
    store_quads,
    store_spread,
    store_triples,
)

WIDTHS = (4, 8, 16, 32)


def kernels(width: int) -> Any:
    @njit
    def read(table: Any, index: Any, out: Any) -> None:
        a, b, c, d = rows4(table, load(index, 0, width))
        store(out, 0, a)
        store(out, width, b)
        store(out, 2 * width, c)
        store(out, 3 * width, d)

    @njit
    def write(table: Any, index: Any, x: Any) -> None:
        put_rows4(
            table,
            load(index, 0, width),
            load(x, 0, width),
            load(x, width, width),
            load(x, 2 * width, width),
            load(x, 3 * width, width),
        )

    return read, write


@pytest.mark.parametrize("width", WIDTHS)
def test_rows_of_eight(width: int) -> None:
    @njit
    def read(table: Any, index: Any, out: Any) -> None:
        a, b, c, d, e, f, g, h = rows8(table, load(index, 0, width))
        store(out, 0, a)
        store(out, width, b)
        store(out, 2 * width, c)
        store(out, 3 * width, d)
        store(out, 4 * width, e)
        store(out, 5 * width, f)
        store(out, 6 * width, g)
        store(out, 7 * width, h)

    rng = np.random.default_rng(width)
    table = rng.normal(size=(50, 8)).astype(np.float32)
    index = rng.permutation(50)[:width].astype(np.int32)
    out = np.zeros((8, width), np.float32)
    read(table, index, out)
    np.testing.assert_array_equal(out, table[index].T)


@pytest.mark.parametrize("width", WIDTHS)
def test_rows_there_and_back(width: int) -> None:
    rng = np.random.default_rng(width)
    read, write = kernels(width)
    table = rng.normal(size=(50, 4)).astype(np.float32)
    for _ in range(5):
        index = rng.permutation(50)[:width].astype(np.int32)
        out = np.zeros((4, width), np.float32)
        read(table, index, out)
        np.testing.assert_array_equal(out, table[index].T)
        copy = np.zeros_like(table)
        write(copy, index, out)
        wanted = np.zeros_like(table)
        wanted[index] = table[index]
        np.testing.assert_array_equal(copy, wanted)


def test_of_equal_rows_the_last_lane_stays() -> None:
    _, write = kernels(8)
    table, x = np.zeros((2, 4), np.float32), np.arange(32, dtype=np.float32)
    write(table, np.ones(8, np.int32), x)
    np.testing.assert_array_equal(table[1], [7, 15, 23, 31])


@njit
def _shapes(x: Any, out: Any) -> None:
    store(out, 0, row(x[0], x[1], x[2], x[3], 8))
    store_spread(out, 8, load(x, 0, 8))


def test_rows_of_scalars_and_spread_lanes() -> None:
    x = np.arange(1, 9, dtype=np.float32)
    out = np.zeros(40, np.float32)
    _shapes(x, out)
    np.testing.assert_array_equal(out[:8], np.tile([1, 2, 3, 4], 2))
    np.testing.assert_array_equal(out[8:], np.repeat(x, 4))


def squares(width: int) -> Any:
    @njit
    def run(x: Any, single: Any, triple: Any, quad: Any) -> None:
        a = load(x, 0, width)
        b = load(x, width, width)
        c = load(x, 2 * width, width)
        store_groups(single, 3, 11, a)
        store_triples(triple, 9, 33, a, b, c)
        store_quads(quad, 12, 44, a, b, c, a)

    return run


@pytest.mark.parametrize("width", WIDTHS)
def test_groups_of_four_go_to_rows_of_a_picture(width: int) -> None:
    x = np.arange(1, 3 * width + 1, dtype=np.float32)
    single, triple = np.zeros((9, 11), np.float32), np.zeros((9, 11, 3), np.float32)
    quad = np.zeros((9, 11, 4), np.float32)
    squares(width)(x, single, triple, quad)
    wanted, colours = np.zeros_like(single), np.zeros_like(triple)
    high = width // 4
    wanted[:high, 3:7] = x[:width].reshape(high, 4)
    colours[:high, 3:7] = x.reshape(3, high, 4).transpose(1, 2, 0)
    np.testing.assert_array_equal(single, wanted)
    np.testing.assert_array_equal(triple, colours)
    np.testing.assert_array_equal(quad[..., :3], colours)
    np.testing.assert_array_equal(quad[..., 3], single)


@pytest.mark.parametrize("width", WIDTHS)
def test_whole_numbers_go_out_in_fours_side_by_side(width: int) -> None:
    @njit
    def run(x: Any, out: Any) -> None:
        a, b = load(x, 0, width), load(x, width, width)
        store_quads(out, 4, 16, a, b, a, a)

    x = np.arange(1, 2 * width + 1, dtype=np.int32)
    out = np.zeros((width + 2, 4), np.int32)
    run(x, out)
    a, b = x.reshape(2, width)
    np.testing.assert_array_equal(out[1:-1], np.stack([a, b, a, a], axis=1))
    assert not out[0].any()
    assert not out[-1].any()


def triples(width: int) -> Any:
    @njit
    def run(x: Any, out: Any) -> None:
        a, b, c = load_triples(x, 6, width)
        store(out, 0, a)
        store(out, width, b)
        store(out, 2 * width, c)

    return run


@pytest.mark.parametrize("width", WIDTHS)
def test_triples_become_columns(width: int) -> None:
    x = np.random.default_rng(width).normal(size=(width + 2, 3)).astype(np.float32)
    out = np.zeros((3, width), np.float32)
    triples(width)(x, out)
    np.testing.assert_array_equal(out, x[2:].T)


@njit
def _whole_numbers(table: Any, index: Any) -> None:
    n = load(index, 0, 8)
    a, b, c, d = rows4(table, n)
    put_rows4(table, n + 8, d, c + 1, b, a)


def test_rows_of_integers() -> None:
    table = np.random.default_rng(1).integers(-(2**31), 2**31, (16, 4)).astype(np.int32)
    wanted, index = table.copy(), np.arange(8, dtype=np.int32)[::-1].copy()
    wanted[8:] = table[:8, ::-1] + np.array([0, 1, 0, 0], np.int32)
    _whole_numbers(table, index)
    np.testing.assert_array_equal(table, wanted)
