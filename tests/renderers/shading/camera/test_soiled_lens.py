"""What lies on the lens: a clean one changes nothing, soil covers what it says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer
from renderers.scene.lens_state import CLEAN, LensState
from renderers.shading import CameraPass
from renderers.shading.bands import RowBands
from renderers.shading.camera.soiled_lens import SoiledLens, soil_pattern

SIZES = (70, 93)


def noise(seed: int = 3) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    return rng.gamma(0.5, 0.1, (*SIZES, 3)).astype(np.float32)


def test_a_clean_lens_costs_nothing_and_changes_no_bit() -> None:
    radiance = noise()
    assert SoiledLens(RowBands(1)).look(radiance, CLEAN) is radiance
    camera = Camera.looking_at((0, 0, 0), (0, 10, 0), size=SIZES[::-1])
    buffer = GBuffer.empty(*SIZES)
    for state in (CLEAN, LensState(seed=5)):
        one, _ = CameraPass(threads=1).finish(radiance, buffer, camera)
        two, _ = CameraPass(threads=1).finish(radiance, buffer, camera, lens=state)
        assert_array_equal(one, two)
    dirty, _ = CameraPass(threads=1).finish(
        radiance, buffer, camera, lens=LensState(0.5, 0.2)
    )
    assert np.abs(one.astype(int) - dirty).max() > 20


@given(st.floats(0, 1), st.floats(0, 1), st.integers(0, 9))
def test_threads_and_what_was_seen_before_change_nothing(
    soil: float, fog: float, seed: int
) -> None:
    state = LensState(soil, fog, seed)
    used = SoiledLens(RowBands(3))
    used.look(noise(8), LensState(0.7, 0.1, 3))
    fresh = SoiledLens(RowBands(1)).look(noise(), state)
    assert_array_equal(used.look(noise(), state), fresh)
    assert np.all(np.isfinite(fresh))
    assert fresh.min() >= 0


@given(st.floats(0, 1), st.floats(0, 1), st.sampled_from((1e-3, 0.2, 40.0)))
def test_light_is_a_factor(soil: float, fog: float, factor: float) -> None:
    state = LensState(soil, fog)
    lens = SoiledLens(RowBands(1))
    dim = lens.look(noise(), state).copy()
    bright = lens.look(noise() * np.float32(factor), state)
    assert_allclose(bright, dim * factor, rtol=2e-4, atol=2e-5 * factor)


@pytest.mark.parametrize("soil", [0.05, 0.3, 0.8])
def test_soil_covers_its_share_of_the_lens(soil: float) -> None:
    """Blood lets red through: covered places turn red, the others keep their light."""
    grey = np.full((*SIZES, 3), 0.4, np.float32)
    seen = SoiledLens(RowBands(1)).look(grey, LensState(soil))
    pattern = soil_pattern(min(SIZES), SIZES[1])
    assert np.mean(pattern[:, : min(SIZES)] < soil) == pytest.approx(soil, abs=2e-3)
    is_red = seen[..., 0] > 1.001 * seen[..., 1]
    assert is_red.mean() == pytest.approx(soil, abs=0.12)
    assert_allclose(seen[~is_red], 0.4, atol=0.1)


def test_fog_takes_contrast_and_keeps_an_even_picture_even() -> None:
    lens = SoiledLens(RowBands(1))
    spread = [float(lens.look(noise(), LensState(fog=f)).std()) for f in (0, 0.3, 0.9)]
    assert spread[0] > spread[1] > spread[2]
    grey = np.full((*SIZES, 3), 0.4, np.float32)
    foggy = lens.look(grey, LensState(fog=1.0))
    assert np.ptp(foggy) < 1e-5
    assert foggy.mean() > 0.4


def test_a_wash_lays_new_soil_elsewhere() -> None:
    lens = SoiledLens(RowBands(1))
    first = lens.look(noise(), LensState(0.4, seed=1)).copy()
    assert np.abs(lens.look(noise(), LensState(0.4, seed=2)) - first).max() > 0.1
