"""Cells of four channels, and of one, against a scalar twin and against float64."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from renderers.simd import cell1, cell4, load, store

SHAPE = (5, 6, 7)


def kernel(width: int) -> Any:
    @njit
    def run(quads: Any, values: Any, voxel: Any, f: Any, out: Any) -> None:
        fx, fy, fz = load(f, 0, width), load(f, width, width), load(f, 2 * width, width)
        at = load(voxel, 0, width)
        a, b, c, d = cell4(quads, at, 7, 42, fx, fy, fz)
        store(out, 0, a)
        store(out, width, b)
        store(out, 2 * width, c)
        store(out, 3 * width, d)
        store(out, 4 * width, cell1(values, at, 7, 42, fx, fy, fz))

    return run


def cells(
    quads: NDArray[Any], width: int
) -> Iterator[tuple[NDArray[Any], NDArray[np.float32], NDArray[np.float32]]]:
    """Read cells; one channel has the bits of the first of four."""
    rng = np.random.default_rng(width)
    z, y, x = (rng.integers(0, n - 1, width) for n in SHAPE)
    # The last cell of all: nothing behind the array may be touched.
    z[0], y[0], x[0] = (n - 2 for n in SHAPE)
    f = rng.random((3, width)).astype(np.float32)
    f[:, 0], f[:, 1] = 1, 0
    out = np.zeros((5, width), np.float32)
    values = np.ascontiguousarray(quads[..., 0])
    kernel(width)(quads, values, ((z * 6 + y) * 7 + x).astype(np.int32), f, out)
    assert out[4].tobytes() == out[0].tobytes()
    assert out.any()
    for lane, (k, j, i) in enumerate(zip(z, y, x, strict=True)):
        yield quads[k : k + 2, j : j + 2, i : i + 2], f[:, lane], out[:4, lane]


def twin(
    corner: NDArray[np.int16], fx: np.float32, fy: np.float32, fz: np.float32
) -> NDArray[np.float32]:
    """corner: (z, y, x, channel)."""
    w = np.int64(np.float32(fy * np.float32(32767)) + np.float32(0.5))
    wide = corner.astype(np.int64)
    rows = (wide[:, 0] * (32767 - w) + wide[:, 1] * w).astype(np.float32)
    ends = rows[0] + fz * (rows[1] - rows[0])
    return np.asarray(ends[0] + fx * (ends[1] - ends[0]))


@pytest.mark.parametrize("most", [4095, 32767])
@pytest.mark.parametrize("width", [4, 8, 16, 32])
def test_cells(width: int, most: int) -> None:
    rng = np.random.default_rng(width + 1)
    quads = rng.integers(-most, most + 1, (*SHAPE, 4)).astype(np.int16)
    for corner, f, found in cells(quads, width):
        np.testing.assert_array_equal(found, twin(corner, *f))
        fx, fy, fz = f.astype(np.float64)
        exact = np.einsum(
            "zyxc,z,y,x", corner, [1 - fz, fz], [1 - fy, fy], [1 - fx, fx]
        )
        assert np.abs(found / 32767 - exact).max() < 0.2 * most / 4095


@pytest.mark.parametrize("width", [4, 32])
def test_cells_of_real_numbers(width: int) -> None:
    quads = np.random.default_rng(width + 1).normal(size=(*SHAPE, 4))
    for corner, (fx, fy, fz), found in cells(quads.astype(np.float32), width):
        line = corner[:, :, 0] + fx * (corner[:, :, 1] - corner[:, :, 0])
        face = line[:, 0] + fy * (line[:, 1] - line[:, 0])
        expected = face[0] + fz * (face[1] - face[0])
        np.testing.assert_array_equal(found, expected)
