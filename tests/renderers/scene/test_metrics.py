"""Closed forms of the picture errors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import image_error, rmse_codes, ssim

C1, C2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2


def noise(seed: int, shape: tuple[int, ...] = (24, 20, 3)) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 200, shape).astype(np.uint8)


def ssim_by_the_window(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> float:
    """Evaluate Wang et al. 2004 for every 11 x 11 window, as it is printed."""
    tap = np.exp(-((np.arange(11) - 5.0) ** 2) / (2 * 1.5**2))
    weight = np.outer(tap, tap) / tap.sum() ** 2
    scores = []
    for row in range(a.shape[0] - 10):
        for column in range(a.shape[1] - 10):
            x = a[row : row + 11, column : column + 11].astype(np.float64)
            y = b[row : row + 11, column : column + 11].astype(np.float64)
            mx, my = (weight * x).sum(), (weight * y).sum()
            vx = (weight * (x - mx) ** 2).sum()
            vy = (weight * (y - my) ** 2).sum()
            cov = (weight * (x - mx) * (y - my)).sum()
            scores.append(
                (2 * mx * my + C1)
                * (2 * cov + C2)
                / ((mx**2 + my**2 + C1) * (vx + vy + C2))
            )
    return float(np.mean(scores))


@given(shift=st.floats(-2, 2), seed=st.integers(0, 10**6))
def test_a_constant_shift_is_every_error_at_once(shift: float, seed: int) -> None:
    image = np.random.default_rng(seed).uniform(0, 1, (8, 9, 4))
    error = image_error(image + shift, image)
    for value in (error.rmse, error.max, error.p999):
        assert value == pytest.approx(abs(shift), abs=1e-14)
    assert error.bias == pytest.approx(shift, abs=1e-14)


def test_one_wrong_pixel_and_a_balanced_pair() -> None:
    reference = np.zeros((20, 25))
    image = reference.copy()
    image[3, 4] = 0.5
    error = image_error(image, reference)
    assert error.rmse == pytest.approx(0.5 / math.sqrt(500), rel=1e-15)
    assert error.max == 0.5
    assert error.bias == pytest.approx(0.5 / 500, rel=1e-15)
    assert error.p999 < 0.5
    image[7, 8] = -0.5
    error = image_error(image, reference)
    assert error.bias == 0
    assert error.rmse == pytest.approx(0.5 / math.sqrt(250), rel=1e-15)


def test_codes_are_compared_without_wrapping() -> None:
    black, white = np.zeros((4, 4), np.uint8), np.full((4, 4), 255, np.uint8)
    assert rmse_codes(black, white) == rmse_codes(white, black) == 255


@pytest.mark.parametrize("shape", [(17, 15), (17, 15, 3)])
def test_ssim_is_the_printed_formula(shape: tuple[int, ...]) -> None:
    a = noise(1, shape)
    b = np.clip(a.astype(int) + noise(2, shape) // 4, 0, 255).astype(np.uint8)
    if len(shape) == 2:
        expected = ssim_by_the_window(a, b)
    else:
        channels = [ssim_by_the_window(a[..., c], b[..., c]) for c in range(3)]
        expected = float(np.mean(channels))
    assert ssim(a, b) == pytest.approx(expected, rel=1e-9)
    assert 0.3 < expected < 0.99


def test_equal_pictures_score_exactly_one() -> None:
    assert ssim(noise(3), noise(3)) == 1.0
    assert ssim(np.zeros((12, 12), np.uint8), np.zeros((12, 12), np.uint8)) == 1.0


@given(a=st.integers(0, 255), b=st.integers(0, 255))
def test_uniform_pictures_are_compared_by_luminance_alone(a: int, b: int) -> None:
    expected = (2 * a * b + C1) / (a * a + b * b + C1)
    found = ssim(np.full((13, 13), a, np.uint8), np.full((13, 13), b, np.uint8))
    # Variances are differences of squares up to 65025, so rounding leaves 1e-11 of
    # the constant C2 = 58.5 that they are added to.
    assert found == pytest.approx(expected, rel=1e-10)


def test_pictures_that_cannot_be_compared_are_refused() -> None:
    with pytest.raises(ValueError, match="SSIM needs"):
        ssim(noise(1), noise(1, (24, 21, 3)))
    with pytest.raises(ValueError, match="SSIM needs"):
        ssim(noise(1, (10, 40)), noise(2, (10, 40)))
    with pytest.raises(ValueError, match="shapes differ"):
        image_error(np.zeros((3, 3)), np.zeros((3, 4)))
