import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.kernels.camera_scalar import (
    add_bloom,
    blur_across,
    blur_along,
    exp2,
    expose_rows,
    glare_rows,
    log2,
)

f32 = np.float32


@pytest.fixture(scope="module")
def planes() -> NDArray[np.float32]:
    return np.random.default_rng(5).random((19, 23, 3)).astype(np.float32)


@given(x=st.floats(-100, 100, width=32))
def test_exp2_is_exp2(x: float) -> None:
    assert exp2(f32(x)) == pytest.approx(2.0**x, rel=5e-7)


@given(x=st.floats(f32(1e-30).item(), f32(1e30).item(), width=32))
def test_log2_is_log2(x: float) -> None:
    assert log2(f32(x)) == pytest.approx(math.log2(x), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("spacing", [1, 2])
def test_blurs_are_convolutions_with_repeated_edges(
    planes: NDArray[np.float32], spacing: int
) -> None:
    taps = np.array([0.4, 0.2, 0.1], np.float32)
    kernel = np.zeros(4 * spacing + 1)
    kernel[::spacing] = [0.1, 0.2, 0.4, 0.2, 0.1]
    for axis, blur in ((1, blur_along), (0, blur_across)):
        got = np.empty_like(planes)
        blur(planes, taps, spacing, got, 0, 7)
        blur(planes, taps, spacing, got, 7, 19)
        reach = 2 * spacing
        wide = [(0, 0), (0, 0), (0, 0)]
        wide[axis] = (reach, reach)
        padded = np.pad(planes.astype(np.float64), wide, mode="edge")
        expected = np.apply_along_axis(np.convolve, axis, padded, kernel, mode="valid")
        np.testing.assert_allclose(got, expected, atol=1e-6)


def test_exposure_interpolates_red_and_blue_and_multiplies(
    planes: NDArray[np.float32],
) -> None:
    rng = np.random.default_rng(1)
    height, width = planes.shape[:2]
    columns = [rng.integers(0, width - 1, width).astype(np.int32) for _ in range(2)]
    rows = [rng.integers(0, height - 1, height).astype(np.int32) for _ in range(2)]
    across = [rng.random((width,), np.float32) for _ in range(2)]
    down = [rng.random((height,), np.float32) for _ in range(2)]
    got = np.empty_like(planes)
    expose_rows(
        planes,
        f32(3),
        columns[0],
        across[0],
        columns[1],
        across[1],
        rows[0],
        down[0],
        rows[1],
        down[1],
        got,
        0,
        height,
    )
    np.testing.assert_allclose(got[..., 1], 3 * planes[..., 1], rtol=1e-6)
    for channel, o in ((0, 0), (2, 1)):
        source: NDArray[np.float64] = 3.0 * planes[..., channel].astype(np.float64)
        c, f = columns[o], across[o]
        source = source[:, c] * (1 - f) + source[:, c + 1] * f
        r, q = rows[o], down[o][:, None]
        expected = source[r] * (1 - q) + source[r + 1] * q
        np.testing.assert_allclose(got[..., channel], expected, atol=2e-6)


def test_glare_is_what_exceeds_white() -> None:
    picture = np.zeros((8, 12, 3), np.float32)
    picture[1, 2] = (0.9, 1.5, 100.0)
    glare = np.full((2, 3, 3), np.nan, np.float32)
    glare_rows(picture, glare, 0, 2)
    np.testing.assert_allclose(glare[0, 0], [0, 0.5 / 16, 3 / 16], rtol=1e-6)
    assert not glare.reshape(-1, 3)[1:].any()


def test_a_constant_bloom_is_added_everywhere() -> None:
    for height, width in ((17, 22), (16, 24), (19, 21)):
        small = np.full((-(-height // 4), -(-width // 4), 3), 0.25, np.float32)
        picture = np.zeros((height, width, 3), np.float32)
        add_bloom(small, picture, 0, 5)
        add_bloom(small, picture, 5, height)
        assert_array_equal(picture, f32(0.25))


def test_a_linear_bloom_stays_linear() -> None:
    small = np.zeros((6, 8, 3), np.float32)
    small += np.arange(8)[None, :, None] + 10 * np.arange(6)[:, None, None]
    picture = np.zeros((24, 32, 3), np.float32)
    add_bloom(small, picture, 0, 24)
    y, x = np.mgrid[2:22, 2:30]
    expected = (x - 1.5) / 4 + 10 * (y - 1.5) / 4
    np.testing.assert_allclose(picture[2:22, 2:30, 1], expected, atol=1e-4)
