import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from renderers.shading import CameraSettings
from renderers.shading.camera.optics import make_optics, runs_of, scaled_axis

sizes = st.integers(8, 600)


@given(size=sizes, scale=st.floats(0.8, 1.2))
def test_runs_tile_the_picture_and_give_back_the_index(size: int, scale: float) -> None:
    source, _ = scaled_axis(size, scale)
    index = np.full(size, -1)
    for first, past, shift in runs_of(source):
        assert np.all(index[first:past] == -1)
        index[first:past] = np.arange(first, past) + shift
    assert_array_equal(index, source)


@given(size=sizes, scale=st.floats(0.8, 1.2))
def test_images_are_scaled_about_their_middle(size: int, scale: float) -> None:
    index, part = scaled_axis(size, scale)
    middle = (size - 1) / 2
    at = np.clip((np.arange(size) - middle) * scale + middle, 0, size - 1)
    np.testing.assert_allclose(index + part, at, atol=1e-4)
    assert 0 <= index.min() <= index.max() <= size - 2


@given(size=st.integers(480, 2000))
def test_taps_keep_light_and_have_the_set_widths(size: int) -> None:
    settings = CameraSettings()
    optics = make_optics(settings, 0.77, size, size)
    variances = []
    for taps, spacing in (
        (optics.soft_taps, 1),
        (optics.rest_taps, optics.spacing),
        (optics.halo_taps, 4),
    ):
        assert taps[0] + 2 * taps[1:].sum() == pytest.approx(1, abs=1e-6)
        at = np.arange(len(taps)) * spacing
        variances.append(2 * float(taps @ at**2))
    scale = size / 480
    soft, rest, halo = variances
    # cut off at 2.2 deviations, a Gaussian keeps about 0.9 of its width
    for variance, width in (
        (soft, settings.soft_px * scale),
        (soft + rest, settings.softer_px * scale),
        (halo + 4, settings.halo_px * scale),
    ):
        assert 0.8 < variance**0.5 / width < 1.05


def test_the_same_camera_gets_the_same_tables() -> None:
    first = make_optics(CameraSettings(), 0.77, 64, 48)
    assert make_optics(CameraSettings(), 0.77, 64, 48) is first
    assert make_optics(CameraSettings(), 0.77, 48, 64) is not first
    assert first.has_bloom
    assert first.has_defocus
