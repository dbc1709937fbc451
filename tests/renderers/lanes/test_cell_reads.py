"""Cells of four channels, and of one, against a scalar twin and against float64."""

from typing import Any

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from renderers.lanes import cell1, cell4, load, store

SHAPE = (5, 6, 7)


def kernel(width: int) -> Any:
    @njit
    def run(quads: Any, voxel: Any, f: Any, out: Any) -> None:
        fx = load(f, 0, width)
        fy = load(f, width, width)
        fz = load(f, 2 * width, width)
        a, b, c, d = cell4(quads, load(voxel, 0, width), 7, 42, fx, fy, fz)
        store(out, 0, a)
        store(out, width, b)
        store(out, 2 * width, c)
        store(out, 3 * width, d)

    return run


def twin(
    corner: NDArray[np.int16], fx: np.float32, fy: np.float32, fz: np.float32
) -> NDArray[np.float32]:
    """corner: (z, y, x, channel)."""
    w = np.int64(np.float32(fy * np.float32(32767)) + np.float32(0.5))
    wide = corner.astype(np.int64)
    rows = (wide[:, 0] * (32767 - w) + wide[:, 1] * w).astype(np.float32)
    ends = rows[0] + fz * (rows[1] - rows[0])
    return np.asarray(ends[0] + fx * (ends[1] - ends[0]))


@pytest.mark.parametrize("width", [4, 8, 16, 32])
def test_cells(width: int) -> None:
    rng = np.random.default_rng(width)
    quads = rng.integers(-4095, 4096, (*SHAPE, 4)).astype(np.int16)
    z, y, x = (rng.integers(0, n - 1, width) for n in SHAPE)
    f = rng.random((3, width)).astype(np.float32)
    f[:, 0], f[:, 1] = 0, 1
    out = np.zeros((4, width), np.float32)
    voxel = ((z * 6 + y) * 7 + x).astype(np.int32)
    kernel(width)(quads, voxel, f, out)
    for lane in range(width):
        k, j, i = z[lane], y[lane], x[lane]
        corner = quads[k : k + 2, j : j + 2, i : i + 2]
        np.testing.assert_array_equal(out[:, lane], twin(corner, *f[:, lane]))
        fx, fy, fz = f[:, lane].astype(np.float64)
        exact = np.einsum(
            "zyxc,z,y,x", corner, [1 - fz, fz], [1 - fy, fy], [1 - fx, fx]
        )
        assert np.abs(out[:, lane] / 32767 - exact).max() < 0.2


@pytest.mark.parametrize("width", [4, 32])
def test_cells_of_real_numbers(width: int) -> None:
    @njit
    def run(quads: Any, voxel: Any, f: Any, out: Any) -> None:
        fx = load(f, 0, width)
        fy = load(f, width, width)
        fz = load(f, 2 * width, width)
        a, b, c, d = cell4(quads, load(voxel, 0, width), 7, 42, fx, fy, fz)
        store(out, 0, a)
        store(out, width, b)
        store(out, 2 * width, c)
        store(out, 3 * width, d)

    rng = np.random.default_rng(width)
    quads = rng.normal(size=(*SHAPE, 4)).astype(np.float32)
    z, y, x = (rng.integers(0, n - 1, width) for n in SHAPE)
    f = rng.random((3, width)).astype(np.float32)
    out = np.zeros((4, width), np.float32)
    run(quads, ((z * 6 + y) * 7 + x).astype(np.int32), f, out)
    for lane in range(width):
        k, j, i = z[lane], y[lane], x[lane]
        corner = quads[k : k + 2, j : j + 2, i : i + 2]
        fx, fy, fz = f[:, lane]
        line = corner[:, :, 0] + fx * (corner[:, :, 1] - corner[:, :, 0])
        face = line[:, 0] + fy * (line[:, 1] - line[:, 0])
        expected = face[0] + fz * (face[1] - face[0])
        np.testing.assert_array_equal(out[:, lane], expected)


@pytest.mark.parametrize("width", [4, 32])
@pytest.mark.parametrize("dtype", [np.int16, np.float32])
def test_one_channel_has_the_bits_of_the_first_of_four(dtype: Any, width: int) -> None:
    @njit
    def run(quads: Any, values: Any, voxel: Any, f: Any, out: Any) -> None:
        fx = load(f, 0, width)
        fy = load(f, width, width)
        fz = load(f, 2 * width, width)
        at = load(voxel, 0, width)
        a, _, _, _ = cell4(quads, at, 7, 42, fx, fy, fz)
        store(out, 0, a)
        store(out, width, cell1(values, at, 7, 42, fx, fy, fz))

    rng = np.random.default_rng(width)
    quads = rng.integers(-32767, 32768, (*SHAPE, 4)).astype(dtype)
    values = np.ascontiguousarray(quads[..., 0])
    z, y, x = (rng.integers(0, n - 1, width) for n in SHAPE)
    # The last cell of all: nothing behind the array may be touched.
    z[0], y[0], x[0] = (n - 2 for n in SHAPE)
    f = rng.random((3, width)).astype(np.float32)
    f[:, 0], f[:, 1] = 1, 0
    out = np.zeros((2, width), np.float32)
    run(quads, values, ((z * 6 + y) * 7 + x).astype(np.int32), f, out)
    assert out[0].tobytes() == out[1].tobytes()
    assert out.any()
