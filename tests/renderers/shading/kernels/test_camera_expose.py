import itertools

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.camera.optics import lateral_colour
from renderers.shading.kernels.camera_expose import (
    Planes,
    W,
    add_excess,
    average_fours,
    expose_rows,
    extend_row,
)

f32 = np.float32
MARGIN = SMALL_MARGIN = W


def whole(count: int) -> int:
    return -(-count // W) * W


def exposed(
    radiance: NDArray[np.float32], lateral: float, white: float, bands: list[int]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint8]]:
    """Expose with gain 3; give the picture, the glare and which rows have any."""
    height, width = radiance.shape[:2]
    # as the camera hands it over; another type would be compiled
    radiance = radiance.view()
    radiance.flags.writeable = False
    red, blue = (lateral_colour(width, height, 1 + x) for x in (lateral, -lateral))
    pitch, columns_small = whole(width) + 2 * MARGIN, -(-width // 4)
    small_pitch = whole(columns_small) + 2 * SMALL_MARGIN
    planes = np.full((height, 3 * pitch), np.nan, np.float32)
    glare = np.full((-(-height // 4), 3 * small_pitch), np.nan, np.float32)
    is_lit = np.full(len(glare), 9, np.uint8)
    raw = np.zeros((12, 3 * pitch), np.float32)
    total = np.zeros((1, 3 * pitch), np.float32)
    for first, last in itertools.pairwise(bands):
        expose_rows(
            radiance, f32(3), f32(white), red, blue,
            Planes(planes, glare, is_lit, MARGIN, SMALL_MARGIN), raw, total,
            first, last,
        )  # fmt: skip
    channels = planes.reshape(height, 3, pitch)
    assert_array_equal(channels[..., 0], channels[..., MARGIN])
    assert_array_equal(channels[..., -1], channels[..., MARGIN + width - 1])
    picture = np.moveaxis(channels[..., MARGIN : MARGIN + width], 1, 2)
    small = glare.reshape(-1, 3, small_pitch)[
        ..., SMALL_MARGIN : SMALL_MARGIN + columns_small
    ]
    return picture, np.moveaxis(small, 1, 2), is_lit


@pytest.fixture(scope="module")
def radiance() -> NDArray[np.float32]:
    picture = np.random.default_rng(5).random((37, 53, 3)).astype(np.float32)
    return picture


@pytest.mark.parametrize("lateral", [0.0, 0.0012, 0.1])
def test_exposure_scales_red_and_blue_and_multiplies(
    radiance: NDArray[np.float32], lateral: float
) -> None:
    got, _, _ = exposed(radiance, lateral, np.inf, [0, 4, 10])
    np.testing.assert_array_equal(got[..., 1], f32(3) * radiance[..., 1])
    for channel, scale in ((0, 1 + lateral), (2, 1 - lateral)):
        expected = 3 * radiance[..., channel].astype(np.float64)
        for axis in (0, 1):
            size = expected.shape[axis]
            middle = (size - 1) / 2
            at = np.clip((np.arange(size) - middle) * scale + middle, 0, size - 1)
            expected = np.apply_along_axis(
                lambda line, at=at: np.interp(at, np.arange(len(line)), line),
                axis,
                expected,
            )
        np.testing.assert_allclose(got[..., channel], expected, atol=4e-5)


def test_bands_do_not_change_a_bit(radiance: NDArray[np.float32]) -> None:
    once = exposed(radiance, 0.05, 1.0, [0, 10])
    parts = exposed(radiance, 0.05, 1.0, [0, 1, 4, 9, 10])
    for a, b in zip(once, parts, strict=True):
        assert_array_equal(a, b)


def test_glare_is_the_mean_of_what_exceeds_white(
    radiance: NDArray[np.float32],
) -> None:
    bright = radiance * f32(2)
    picture, glare, is_lit = exposed(bright, 0.0, 1.0, [0, 10])
    excess = np.clip(picture.astype(np.float64) - 1, 0, 3)
    padded = np.pad(excess, [(0, 3), (0, 3), (0, 0)])[:40, :56]
    expected = padded.reshape(10, 4, 14, 4, 3).sum((1, 3)) / 16
    np.testing.assert_allclose(glare, expected, atol=1e-6)
    assert is_lit.all()


def test_without_white_nothing_glares(radiance: NDArray[np.float32]) -> None:
    _, glare, is_lit = exposed(radiance, 0.01, np.inf, [0, 10])
    assert not is_lit.any()
    assert not glare.any()


def test_only_rows_with_light_are_lit() -> None:
    radiance = np.zeros((40, 40, 3), np.float32)
    radiance[17, 39, 2] = 0.5
    _, glare, is_lit = exposed(radiance, 0.0, 1.0, [0, 10])
    assert np.flatnonzero(is_lit).tolist() == [4]
    assert np.argwhere(glare).tolist() == [[4, 9, 2]]
    assert glare[4, 9, 2] == pytest.approx(0.5 / 16)


def test_excess_is_limited_and_the_margin_does_not_count() -> None:
    planes = np.zeros((1, 9 * W), np.float32)
    planes[0, 3 * W + W + 4] = 100.0
    extend_row(planes, 0, 3 * W, W, 5)
    total = np.zeros((1, 9 * W), np.float32)
    add_excess(planes, 0, f32(1), True, total)
    add_excess(planes, 0, f32(1), False, total)
    glare = np.zeros((1, 9 * W), np.float32)
    average_fours(total, W, 5, glare, 0, W)
    assert glare[0, 3 * W + W + 1] == f32(6 / 16)
    assert np.count_nonzero(glare) == 1
