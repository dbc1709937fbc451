"""What lies on the lens: a clean one changes nothing, soil covers what it says."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer
from renderers.scene.lens_state import CLEAN, LensState, all_over
from renderers.shading import CameraPass
from renderers.shading.bands import RowBands
from renderers.shading.camera.soiled_lens import SoiledLens, soil_pattern

SIZES = (70, 93)


def even(soil: float, fog: float = 0.0, seed: int = 0) -> LensState:
    return LensState(all_over(soil), fog=fog, seed=seed)


def field() -> NDArray[np.bool_]:
    """Mark the pixels in the round field."""
    y, x = np.indices(SIZES)
    middle = (np.array(SIZES) - 1) / 2
    return np.asarray(np.hypot(y - middle[0], x - middle[1]) < min(SIZES) / 2)


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
        radiance, buffer, camera, lens=even(0.5, 0.2)
    )
    assert np.abs(one.astype(int) - dirty).max() > 20


@given(st.floats(0, 1), st.floats(0, 1), st.integers(0, 9))
def test_threads_and_what_was_seen_before_change_nothing(
    soil: float, fog: float, seed: int
) -> None:
    state = LensState(all_over(soil), all_over(fog), fog, soil, seed)
    used = SoiledLens(RowBands(3))
    used.look(noise(8), LensState(all_over(0.7), fog=0.1, seed=3))
    fresh = SoiledLens(RowBands(1)).look(noise(), state)
    assert_array_equal(used.look(noise(), state), fresh)
    assert np.all(np.isfinite(fresh))
    assert fresh.min() >= 0


@given(st.floats(0, 1), st.floats(0, 1), st.sampled_from((1e-3, 0.2, 40.0)))
def test_light_is_a_factor(soil: float, fog: float, factor: float) -> None:
    state = LensState(all_over(soil), all_over(fog), fog, soil)
    lens = SoiledLens(RowBands(1))
    dim = lens.look(noise(), state).copy()
    bright = lens.look(noise() * np.float32(factor), state)
    assert_allclose(bright, dim * factor, rtol=2e-4, atol=2e-5 * factor)


@pytest.mark.parametrize("soil", [0.05, 0.3, 0.8])
def test_soil_covers_its_share_of_the_lens(soil: float) -> None:
    """Blood lets red through: covered places turn red, the others keep their light."""
    grey = np.full((*SIZES, 3), 0.4, np.float32)
    seen = SoiledLens(RowBands(1)).look(grey, even(soil))
    pattern = soil_pattern(min(SIZES), SIZES[1])
    assert np.mean(pattern[:, : min(SIZES)] < soil) == pytest.approx(soil, abs=2e-3)
    is_red = seen[..., 0] > 1.001 * seen[..., 1]
    assert is_red[field()].mean() == pytest.approx(soil, abs=0.12)
    assert_allclose(seen[~is_red], 0.4, atol=0.1)


@given(st.integers(0, 7), st.floats(0.1, 1.0), st.sampled_from(("blood", "mucus")))
def test_soil_of_a_sector_stays_there_and_grows_from_the_rim(
    sector: int, share: float, what: str
) -> None:
    radiance, shares = noise(), [0.0] * 8
    shares[sector] = share
    state = LensState(**{what: tuple(shares)})  # type: ignore[arg-type]
    seen = SoiledLens(RowBands(1)).look(radiance, state)
    y, x = (np.indices(SIZES).T - (np.array(SIZES) - 1) / 2).T / (min(SIZES) / 2)
    ahead = math.tau * sector / 8
    along = x * math.cos(ahead) - y * math.sin(ahead)
    changed = np.abs(seen - radiance).max(axis=2) > 0.01
    # a cell of the coarse grid beyond the neighbouring sectors' middles
    assert not changed[(along < -0.12)].any()
    inner = np.hypot(x, y) < 0.5
    assert changed[inner & field()].mean() <= changed[~inner & field()].mean() + 0.01
    assert seen.min() >= 0


def test_soil_fog_and_drops_are_told_apart() -> None:
    """Blood is red and mucus is not, fog is everywhere alike, drops are small."""
    grey, lens = np.full((*SIZES, 3), 0.4, np.float32), SoiledLens(RowBands(1))
    red, milk, fog, drops = (
        lens.look(grey if n != 3 else noise(), state).copy()
        for n, state in enumerate(
            (
                LensState(blood=all_over(0.5)),
                LensState(mucus=all_over(0.5)),
                LensState(fog=0.5),
                LensState(drops=1.0, seed=2),
            )
        )
    )
    assert np.ptp(red[field()] / red[field()][:, :1], axis=0).max() > 0.5
    assert_allclose(milk, 0.4, atol=0.1)
    assert_allclose(milk[..., 0], milk[..., 2], rtol=1e-5)
    assert np.ptp(fog) < 1e-5
    changed = np.any(drops != noise(), axis=2)
    assert 0.02 < changed[field()].mean() < 0.25


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
    first = lens.look(noise(), even(0.4, seed=1)).copy()
    assert np.abs(lens.look(noise(), even(0.4, seed=2)) - first).max() > 0.1
