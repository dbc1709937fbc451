import math

import numpy as np
import pytest

from scenarios.metrics import (
    HazardGaps,
    Measured,
    Metric,
    PoseNoise,
    SessionNoise,
    definitions_named,
    measure,
    recorded_noise,
)
from scenarios.metrics.metric import SCOPE
from system import UserError
from tests.scenarios.metrics.tracks import of_scope, swaying, track, wander

SIGMA = 0.05
NOISE = PoseNoise.even(SIGMA, 0.0, 0.0, "test")
BOTH = SessionNoise(NOISE, NOISE)
STILL_PER_SAMPLE = 4 / math.sqrt(math.pi)
NAMES = ("path length, raw", "path length", "mean speed", "depth", "LDLJ, vector form")


def of_one(measured: Measured, name: str, noise: SessionNoise | None = BOTH) -> Metric:
    (found,) = (
        metric
        for metric in measure(measured, noise, definitions_named((name,)))
        if metric.role == SCOPE
    )
    return found


@pytest.mark.parametrize("name", NAMES)
def test_sigma_is_that_of_many_recordings(name: str) -> None:
    """What one recording tells of itself, against 200 recordings of the same hand."""
    times, tip = wander(6.0)
    rng = np.random.default_rng(11)

    def recorded() -> Measured:
        return of_scope(track(times, tip + SIGMA * rng.standard_normal(tip.shape)))

    values = [of_one(recorded(), name, None).value for _ in range(200)]
    brute = float(np.std(np.array(values, float), ddof=1))
    told = of_one(recorded(), name).sigma
    # 32 draws know a standard deviation to an eighth, 200 to a twentieth
    assert told == pytest.approx(brute, rel=0.35)
    assert of_one(recorded(), name, None).sigma is None


def test_the_floor_of_the_raw_path_is_the_walk_of_a_still_tip() -> None:
    times, tip = wander(10.0)
    found = of_one(of_scope(track(times, tip)), "path length, raw")
    expected = STILL_PER_SAMPLE * SIGMA * (len(times) - 1)
    assert pytest.approx(2.257, abs=5e-4) == STILL_PER_SAMPLE
    assert found.floor == pytest.approx(expected, rel=0.05)
    assert not found.is_noise


def test_a_still_tool_is_below_the_floor_and_a_moving_one_is_not() -> None:
    times = np.arange(0.0, 10.0, 0.01)
    shake = SIGMA * np.random.default_rng(5).standard_normal((len(times), 3))
    still = of_one(of_scope(track(times, shake)), "path length")
    assert still.is_noise
    moving = of_one(of_scope(track(times, shake + 3 * times[:, None])), "path length")
    assert not moving.is_noise


def test_noise_along_one_axis_has_the_shape_of_its_covariance() -> None:
    flat = PoseNoise(np.diag([0.0, 0.0, SIGMA**2]), 0.0, 0.0, "test")
    times = np.arange(0.0, 20.0, 0.01)
    level = of_scope(track(times, np.zeros((len(times), 3))))
    found = of_one(level, "path length, raw", SessionNoise(flat, flat))
    # along a line: |difference| of two has the mean 2 sigma / sqrt(pi)
    expected = 2 / math.sqrt(math.pi) * SIGMA * (len(times) - 1)
    assert found.floor == pytest.approx(expected, rel=0.05)
    assert flat.axis_mm == pytest.approx(SIGMA / math.sqrt(3))


def test_the_registration_moves_distances_and_no_paths() -> None:
    shifted = PoseNoise.even(0.0, 0.0, 0.4, "test")
    times, tip = wander(4.0)
    gaps = HazardGaps(times, {"orbit": 5.0 + 0 * times})
    measured = of_scope(track(times, tip), hazards=gaps)
    noise = SessionNoise(shifted, shifted)
    assert of_one(measured, "path length", noise).sigma == pytest.approx(0.0, abs=1e-9)
    near = of_one(measured, "smallest distance", noise).sigma
    assert near == pytest.approx(0.4, rel=0.4)


@pytest.mark.parametrize("sigma", [0.01, 0.05, 0.23])
def test_the_noise_of_a_record_is_found_in_it(sigma: float) -> None:
    times, tip = wander(20.0)
    rng = np.random.default_rng(3)
    axes = swaying(times) + 0.001 * rng.standard_normal(tip.shape)
    noisy = track(times, tip + sigma * rng.standard_normal(tip.shape), axes)
    tip_mm, turn_rad = recorded_noise(noisy, 0.5)
    assert tip_mm == pytest.approx(sigma, rel=0.05)
    assert turn_rad == pytest.approx(0.001, rel=0.05)


def test_a_smooth_hand_has_hardly_any_noise() -> None:
    times, tip = wander(20.0)
    assert recorded_noise(track(times, tip), 0.5)[0] < 1e-3
    assert recorded_noise(track(times[:3], tip[:3]), 0.5) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("turn_rad", "offset_mm"), [(-0.1, 0.0), (0.0, -1.0), (math.nan, 0.0)]
)
def test_noise_that_is_none_is_refused(turn_rad: float, offset_mm: float) -> None:
    with pytest.raises(UserError, match="noise"):
        PoseNoise.even(0.1, turn_rad, offset_mm, "test")
    with pytest.raises(UserError, match="covariance"):
        PoseNoise(np.zeros(3), 0.0, 0.0, "test")
