import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from renderers.shading.kernels.camera_blur import W, blur_across, blur_along, find_rows

TAPS = np.array([0.4, 0.2, 0.1], np.float32)


@pytest.fixture(scope="module")
def planes() -> NDArray[np.float32]:
    return np.random.default_rng(3).random((19, 9 * W)).astype(np.float32)


@pytest.mark.parametrize("spacing", [1, 2, 5])
def test_blurs_along_are_convolutions(
    planes: NDArray[np.float32], spacing: int
) -> None:
    pitch = planes.shape[1] // 3
    got = np.zeros_like(planes)
    blur_along(
        planes, 4 * 3 * pitch, TAPS, spacing, got, 7 * 3 * pitch, pitch, W, 2 * W
    )
    got = got.reshape(-1, 3, pitch)
    line = planes[4].astype(np.float64).reshape(3, pitch)
    expected = 0.4 * line[:, W : 2 * W]
    for k, tap in ((1, 0.2), (2, 0.1)):
        for step in (-k * spacing, k * spacing):
            expected += tap * line[:, W + step : 2 * W + step]
    assert_allclose(got[7, :, W : 2 * W], expected, atol=1e-6)
    got[7, :, W : 2 * W] = 0
    assert not got.any()


@pytest.mark.parametrize("spacing", [1, 2])
@pytest.mark.parametrize("row", [0, 1, 9, 18])
def test_blurs_across_repeat_the_outer_rows(
    planes: NDArray[np.float32], spacing: int, row: int
) -> None:
    pitch = planes.shape[1] // 3
    size = 3 * pitch
    reach = 2 * spacing
    ring = np.full((2 + 2 * reach + 1, size), np.nan, np.float32)
    rows = len(planes)
    for n in range(max(row - reach, 0), min(row + reach + 1, rows)):
        ring[2 + n % (2 * reach + 1)] = planes[n]
    places = np.empty((3, 2), np.int64)
    find_rows(row, rows, spacing, 2 * size, 2 * reach + 1, size, places)
    blur_across(ring, places, TAPS, ring, 0, pitch, 0, pitch)
    weights = {-2: 0.1, -1: 0.2, 0: 0.4, 1: 0.2, 2: 0.1}
    expected = sum(
        weight * planes[np.clip(row + k * spacing, 0, rows - 1)].astype(np.float64)
        for k, weight in weights.items()
    )
    assert_allclose(ring[0], expected, atol=1e-6)


def test_taps_that_are_one_keep_every_bit(planes: NDArray[np.float32]) -> None:
    pitch = planes.shape[1] // 3
    got = np.zeros_like(planes)
    one = np.array([1, 0], np.float32)
    blur_along(planes, 0, one, 1, got, 0, pitch, W, 2 * W)
    got, planes = (x.reshape(-1, 3, pitch) for x in (got, planes))
    assert_array_equal(got[0, :, W : 2 * W], planes[0, :, W : 2 * W])
