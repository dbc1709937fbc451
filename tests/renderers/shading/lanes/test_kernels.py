import numpy as np
from numba import njit
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.lanes.kernels import Four, byte_pairs, rows2, rows8

f32 = np.float32


@njit(error_model="numpy")
def call_rows8(
    table: NDArray[np.float32], o: NDArray[np.int64], t: NDArray[np.float32]
) -> Four:
    return rows8(table, o[0], o[1], o[2], o[3], o[4], o[5], t[0], t[1], t[2])


@njit(error_model="numpy")
def call_rows2(table: NDArray[np.float32], a: int, b: int, t: np.float32) -> Four:
    return rows2(table, a, b, t)


@njit(error_model="numpy")
def call_byte_pairs(
    pairs: NDArray[np.uint16], at: int, dy: int, dz: int, t: NDArray[np.float32]
) -> Four:
    return byte_pairs(pairs, at, dy, dz, t[0], t[1], t[2])


def lerp(
    a: NDArray[np.float32], b: NDArray[np.float32], t: np.float32
) -> NDArray[np.float32]:
    return (a + t * (b - a)).astype(np.float32)


def test_rows8_is_the_scalar_formula_bit_for_bit() -> None:
    rng = np.random.default_rng(0)
    table = rng.normal(size=4096).astype(np.float32)
    for _ in range(50):
        o = rng.integers(0, 1300, 6)
        t = rng.random(3).astype(np.float32)

        def row(
            x: int, y: int, z: int, o: NDArray[np.int64] = o
        ) -> NDArray[np.float32]:
            start = int(o[x] + o[2 + y] + o[4 + z])
            return table[start : start + 4]

        planes = [
            lerp(
                lerp(row(0, 0, z), row(1, 0, z), t[0]),
                lerp(row(0, 1, z), row(1, 1, z), t[0]),
                t[1],
            )
            for z in (0, 1)
        ]
        assert_array_equal(call_rows8(table, o, t), lerp(planes[0], planes[1], t[2]))


def test_rows2_is_the_scalar_formula_bit_for_bit() -> None:
    rng = np.random.default_rng(1)
    table = rng.normal(size=64).astype(np.float32)
    for a, b in ((0, 8), (17, 3), (60, 60)):
        t = f32(rng.random())
        expected = lerp(table[a : a + 4], table[b : b + 4], t)
        assert_array_equal(call_rows2(table, a, b, t), expected)


def test_byte_pairs_interpolates_both_channels() -> None:
    rng = np.random.default_rng(2)
    shape = (5, 6, 7)
    low = rng.integers(0, 256, shape)
    high = rng.integers(0, 256, shape)
    pairs = (low + 256 * high).astype(np.uint16).reshape(-1)
    for _ in range(50):
        k, j, i = (int(rng.integers(0, n - 1)) for n in shape)
        t = rng.random(3).astype(np.float32)
        got = call_byte_pairs(pairs, (k * 6 + j) * 7 + i, 7, 42, t)
        for channel, values in enumerate((low, high)):
            cell = values[k : k + 2, j : j + 2, i : i + 2].astype(np.float64)
            for axis, part in ((0, t[2]), (0, t[1]), (0, t[0])):
                cell = (1 - part) * cell.take(0, axis) + part * cell.take(1, axis)
            np.testing.assert_allclose(got[channel], float(cell), atol=2e-4)
