import math
from collections.abc import Callable

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from renderers.fsr import FuzzySet
from renderers.fsr.footprint import gaussian_footprint
from renderers.fsr.kernels.depth_sheets import footprint
from renderers.fsr.kernels.project_splats import CUT
from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.fsr.splats.gaussian_falloff import SCALE, WEIGHT
from renderers.fsr.splats.splat_tiles import SQUARE
from renderers.lanes import load, store
from renderers.scene import (
    Camera,
    Scene,
    Volume,
)
from renderers.scene.thread_team import ThreadTeam

F32 = NDArray[np.float32]
Splats = tuple[FuzzySet, Scene]


def test_what_is_behind_an_instrument_is_hidden_pixel_by_pixel(
    team: ThreadTeam,
    slab: Callable[..., Volume],
    above: Callable[..., Camera],
    unlit: Callable[..., Splats],
) -> None:
    volume = slab()
    drawer = SplatRasterizer(*unlit(volume, 0.3))
    camera = above(volume)
    limit = np.full((120, 120), np.inf, np.float32)
    limit[:, :60] = 1.0
    limit[:40, 60:] = 1e6
    free = drawer.draw(camera, team)
    cut = drawer.draw(camera, team, limit_mm=limit)
    assert not cut.rgba[:, :60].any()
    assert cut.rgba[:, 60:].tobytes() == free.rgba[:, 60:].tobytes()
    middle = np.full((120, 120), 80.0 - 2.5, np.float32)  # half of six layers
    half = drawer.draw(camera, team, limit_mm=middle).rgba[..., 3]
    assert half.mean() == pytest.approx(-math.expm1(-0.3 * 3), rel=0.02)
    with pytest.raises(ValueError, match="do not fit"):
        drawer.draw(camera, team, limit_mm=limit[:50])


def test_depth_is_where_half_of_the_light_is_gone(
    team: ThreadTeam,
    slab: Callable[..., Volume],
    above: Callable[..., Camera],
    unlit: Callable[..., Splats],
) -> None:
    volume = slab()
    drawer = SplatRasterizer(*unlit(volume, 5.0))
    for mode in SplatMode:
        image = drawer.draw(above(volume), team, mode, with_depth=True)
        assert image.depth_mm is not None
        np.testing.assert_allclose(image.depth_mm, 80.0 - 5.0, atol=1.0)
    faint = SplatRasterizer(*unlit(volume, 0.01))
    image = faint.draw(above(volume), team, with_depth=True)
    assert image.depth_mm is not None
    assert np.all(np.isinf(image.depth_mm))


def test_the_footprint_is_the_gaussian_to_one_in_eight_thousand() -> None:
    """One at the centre, nothing from the cut on, and nearly the Gaussian's mass."""
    r2 = np.linspace(0, CUT**2, 4001)
    weights = np.array([weight(math.sqrt(d)) for d in r2])
    truth = gaussian_footprint(r2)
    assert weights[0] == pytest.approx(1, abs=1e-6)
    assert np.abs(weights - truth).max() < 1.25e-4
    assert np.all(np.diff(weights) <= 0)
    assert weights.mean() == pytest.approx(truth.mean(), rel=2e-5)
    for beyond in (CUT, 3.1, 31, 1e15):
        assert weight(beyond) == 0


@njit(error_model="numpy")
def weigh(record: F32, right: F32, weights: F32) -> None:
    """Weigh sixteen pixels of one row."""
    u = load(right, 0, SQUARE)
    store(weights, 0, footprint(record, 0, u, u - u))


def weight(sigmas: float) -> float:
    """Weigh a pixel so far right of a round footprint's centre."""
    round_ = SCALE / np.float32(CUT**2)
    record = np.array([0, 0, round_, 0, round_] + [0] * 16, np.float32)
    weights = np.zeros(SQUARE, np.float32)
    weigh(record, np.full(SQUARE, sigmas, np.float32), weights)
    assert np.all(weights == weights[0])
    return float(weights[0] * WEIGHT)
