import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.shading.kernels.camera_meter import count_within, find_gain, sample_light

TARGET, MOST = 0.17, 1e5


@given(seed=st.integers(0, 1000), spread=st.floats(0.1, 3))
def test_the_gain_brings_the_clipped_mean_to_the_target(
    seed: int, spread: float
) -> None:
    rng = np.random.default_rng(seed)
    luminance = rng.lognormal(-4, spread, 300).astype(np.float32)
    weight = rng.random(300).astype(np.float32)
    weight /= weight.sum()
    gain = find_gain(luminance, weight, TARGET, MOST, 50)
    mean = np.minimum(gain * luminance.astype(np.float64), 1) @ weight
    assert mean == pytest.approx(TARGET, rel=1e-6)


def test_too_little_light_gets_the_most() -> None:
    luminance = np.zeros(10, np.float32)
    weight = np.full(10, 0.1, np.float32)
    assert find_gain(luminance, weight, TARGET, MOST, 50) == MOST
    luminance[:] = 1e-9
    assert find_gain(luminance, weight, TARGET, MOST, 50) == MOST
    # however bright a tenth of the samples is, their mean ends at a tenth
    luminance[0] = 1.0
    luminance[1:] = 0.0
    assert find_gain(luminance, weight, TARGET, MOST, 50) == MOST


def test_samples_are_the_listed_pixels() -> None:
    radiance = np.random.default_rng(1).random((5, 6, 3)).astype(np.float32)
    rows, columns = np.array([0, 4, 2], np.int32), np.array([5, 0, 3], np.int32)
    luminance, largest = np.empty(3, np.float32), np.empty(3, np.float32)
    sample_light(radiance, rows, columns, luminance, largest)
    picked = radiance[rows, columns]
    np.testing.assert_allclose(luminance, picked @ [0.2126, 0.7152, 0.0722], rtol=1e-6)
    np.testing.assert_array_equal(largest, picked.max(axis=1))


@given(seed=st.integers(0, 1000), factor=st.floats(0.125, 50, width=32))
def test_what_stays_within_is_counted(seed: int, factor: float) -> None:
    values = np.random.default_rng(seed).random(40).astype(np.float32)
    times, most = np.float32(factor), np.float32(1.15)
    assert count_within(values, times, most) == np.sum(values * times <= most)
