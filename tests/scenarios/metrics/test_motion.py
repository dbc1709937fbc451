import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scenarios.metrics import Measured, Reference, Settings
from scenarios.metrics.metric import SCOPE, Found
from scenarios.metrics.motion import (
    MOTION,
    actions,
    depth_mm,
    economy,
    idle_share,
    mean_speed_mm_s,
    nearest_to_targets_mm,
    path_inefficiency_percent,
    path_mm,
    raw_path_mm,
    retracting_mm,
    rotation_deg,
    speed_peaks_per_min,
    task_time_s,
    tip_bimanual,
    turn_actions,
    turn_bimanual,
)
from tests.scenarios.metrics.tracks import (
    minimum_jerk,
    moved,
    of_scope,
    swaying,
    track,
    wander,
)

RNG = np.random.default_rng


def line(speeds: list[tuple[float, float]], rate_hz: float = 100.0) -> Measured:
    """A way along y at given speeds, mm/s, for given seconds."""
    steps = np.concatenate(
        [np.full(round(s * rate_hz), v / rate_hz) for v, s in speeds]
    )
    y = np.concatenate([[0.0], np.cumsum(steps)])
    tips = np.stack([0 * y, y, 0 * y], axis=1)
    return of_scope(track(np.arange(len(y)) / rate_hz, tips))


def test_a_reach_has_its_length_and_time() -> None:
    times, tip = minimum_jerk(100.0, 0.5)
    measured = of_scope(track(times, tip))
    assert path_mm(measured, SCOPE).value == pytest.approx(20.0, abs=0.02)
    assert raw_path_mm(measured, SCOPE).value == pytest.approx(20.0)
    assert task_time_s(measured, SCOPE).value == pytest.approx(1.5)
    assert mean_speed_mm_s(measured, SCOPE).value == pytest.approx(20 / 1.5, abs=0.02)


@pytest.mark.parametrize(
    ("rate_hz", "sigma", "raw", "filtered"),
    [(100, 0.05, 29.5, 20.4), (250, 0.05, 49.6, 20.3), (250, 0.1, 88.6, 20.6)],
)
def test_noise_lengthens_the_raw_path_and_hardly_the_filtered_one(
    rate_hz: int, sigma: float, raw: float, filtered: float
) -> None:
    times, tip = minimum_jerk(rate_hz, 0.5)
    rng = RNG(1)
    found = []
    for _ in range(40):
        noisy = of_scope(track(times, tip + sigma * rng.standard_normal(tip.shape)))
        found.append([raw_path_mm(noisy, SCOPE).value, path_mm(noisy, SCOPE).value])
    means = np.mean(np.array(found, float), axis=0)
    assert means == pytest.approx([raw, filtered], rel=0.02)


def test_a_still_probe_walks_by_its_noise() -> None:
    """4 sigma / sqrt(pi) a sample."""
    count, sigma = 20_000, 0.05
    tip = sigma * RNG(2).standard_normal((count, 3))
    length = raw_path_mm(of_scope(track(np.arange(count) / 100, tip)), SCOPE).value
    assert length is not None
    assert length / (count - 1) / sigma == pytest.approx(2.257, rel=0.01)
    assert 4 / math.sqrt(math.pi) == pytest.approx(2.257, abs=5e-4)


def test_a_shaft_that_goes_along_itself_has_all_its_path_as_depth() -> None:
    measured = line([(20, 2), (-20, 1)])
    path = path_mm(measured, SCOPE).value
    assert depth_mm(measured, SCOPE).value == pytest.approx(path)
    back = retracting_mm(measured, SCOPE).value
    assert back == pytest.approx(20.0, abs=0.8)
    times, tip = minimum_jerk(100.0)
    aside = of_scope(track(times, tip))
    assert depth_mm(aside, SCOPE).value == pytest.approx(0.0, abs=1e-9)


def test_a_turn_adds_up() -> None:
    times = np.arange(0.0, 4.0, 0.01)
    angle = np.radians(30.0) * (1 - np.cos(np.pi * times / 2))
    axes = np.stack([np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    scope = track(times, np.zeros((len(times), 3)), axes)
    value = rotation_deg(of_scope(scope), SCOPE).value
    assert value == pytest.approx(120.0, abs=0.1)


def test_mean_speed_is_not_biased_by_jitter() -> None:
    count, rate = 4000, 100.0
    times = np.arange(count) / rate
    times[1:-1] += RNG(3).uniform(-0.45, 0.45, count - 2) / rate
    tips = np.stack([10.0 * np.arange(count) / rate, times * 0, times * 0], axis=1)
    measured = of_scope(track(times, tips))
    assert mean_speed_mm_s(measured, SCOPE).value == pytest.approx(10.0, rel=0.01)
    ratios = np.diff(tips[:, 0]) / np.diff(times)
    assert ratios.mean() > 11.5  # what PerkTutor's mean of ratios would tell


def test_idle_time_is_a_share() -> None:
    found = idle_share(line([(20, 2), (0, 1), (20, 2), (0, 0.2), (20, 0.8)]), SCOPE)
    assert found.value == pytest.approx(1.0 / 6.0, abs=0.02)
    ((begin, end),) = found.intervals
    assert (begin, end) == pytest.approx((2.0, 3.0), abs=0.1)


def test_the_way_back_to_the_beginning_has_no_inefficiency() -> None:
    found = path_inefficiency_percent(line([(20, 1), (-20, 1)]), SCOPE)
    assert found.value is None
    assert "beginning" in found.reason
    found = path_inefficiency_percent(line([(20, 2), (-20, 1)]), SCOPE)
    assert found.value == pytest.approx(200.0, rel=0.05)


def test_economy_is_the_shortest_way_by_the_way_taken() -> None:
    times, tip = minimum_jerk(100.0)
    scope = track(times, tip)
    measured = Measured(scope, scope, reference=Reference(10.0, 0.0, 1.0))
    assert economy(measured).value == pytest.approx(0.5, abs=1e-3)
    measured = Measured(scope, scope, reference=Reference(30.0, 0.0, 1.0))
    assert economy(measured).value == 1.0
    assert economy(of_scope(scope)).value is None


def test_actions_have_hysteresis() -> None:
    fast, slow = 80.0, 5.0
    once = line([(slow, 1), (fast, 1), (slow, 0.1), (fast, 1), (slow, 1)])
    assert actions(once, SCOPE).value == 1.0
    twice = line([(slow, 1), (fast, 1), (slow, 1), (fast, 1), (slow, 1)])
    assert actions(twice, SCOPE).value == 2.0
    assert turn_actions(twice, SCOPE).value == 0.0


def test_speed_peaks_are_counted_a_minute() -> None:
    times, tip = minimum_jerk(100.0, 1.0)
    found = speed_peaks_per_min(of_scope(track(times, tip)), SCOPE)
    assert isinstance(found, dict)
    values = [found[f"above {v} mm/s"].value for v in (20, 50, 100)]
    assert values == pytest.approx([30.0, 0.0, 0.0], rel=0.01)


def test_hands_that_move_alike_are_correlated() -> None:
    times, tips = wander()
    left = track(times, tips, swaying(times))
    right = track(times, 2.0 * tips + 5.0, swaying(times))
    measured = Measured(left, right)
    for compute in (tip_bimanual, turn_bimanual):
        assert compute(measured).value == pytest.approx(1.0, abs=1e-6)
    still = track(times, 0 * tips)
    assert tip_bimanual(Measured(left, still)).value is None


def test_bimanual_dexterity_is_pearsons_correlation() -> None:
    times, tips = wander()
    left, right = track(times, tips), track(times, tips[::-1] * [1, 2, 0.5])
    measured = Measured(left, right)
    (a,), (b,) = measured.scope_pieces, measured.tool_pieces
    expected = np.corrcoef(a.speed_mm_s, b.speed_mm_s)[0, 1]
    assert tip_bimanual(measured).value == pytest.approx(expected, abs=1e-9)


def test_the_nearest_approach_is_told_with_its_moment() -> None:
    times, tip = minimum_jerk(100.0)
    target = tip[60] + [0.0, 3.0, 0.0]
    measured = of_scope(track(times, tip), targets={"ostium": target})
    found = nearest_to_targets_mm(measured, SCOPE)
    assert isinstance(found, dict)
    assert found["ostium"].value == pytest.approx(3.0)
    assert found["ostium"].intervals == ((0.6, 0.6),)


def answers(measured: Measured) -> dict[str, Found]:
    return {
        f"{definition.role} {name}": found
        for definition in MOTION
        for name, found in definition.answers(measured).items()
    }


def is_same(one: float | None, other: float | None, share: float) -> bool:
    """Both are missing, or both are equal up to a share of themselves."""
    if one is None or other is None:
        return one is other
    return bool(np.isclose(one, other, rtol=share, atol=1e-9))


def test_nothing_changes_where_or_when_it_happens() -> None:
    times, tips = wander()
    first = track(times, tips, swaying(times))
    second = track(times, tips[::-1] + 3.0, swaying(times[::-1]))
    turn = Rotation.from_euler("zyx", [0.4, -1.0, 2.0])
    shift = np.array([30.0, -7.0, 12.0])
    later = Measured(
        moved(track(times + 100, tips, swaying(times)), turn, shift),
        moved(track(times + 100, tips[::-1] + 3.0, swaying(times[::-1])), turn, shift),
    )
    before, after = answers(Measured(first, second)), answers(later)
    assert before.keys() == after.keys()
    for name, found in before.items():
        assert is_same(after[name].value, found.value, 1e-6), name


def test_a_mirror_changes_nothing() -> None:
    times, tips = wander()
    axes = swaying(times)
    mirror = np.array([-1.0, 1.0, 1.0])
    one = answers(of_scope(track(times, tips, axes)))
    other = answers(of_scope(track(times, mirror * tips, mirror * axes)))
    for name, found in one.items():
        assert is_same(other[name].value, found.value, 1e-9), name


@pytest.mark.parametrize("rate_hz", [50.0, 200.0, 1000.0])
def test_the_sampling_rate_hardly_matters(rate_hz: float) -> None:
    one, other = (
        answers(of_scope(track(times, tips, swaying(times))))
        for times, tips in (wander(8.0), wander(8.0, rate_hz))
    )
    for name in ("path length", "depth", "rotation", "mean speed", "idle share"):
        expected = one[f"{SCOPE} {name}"].value
        assert other[f"{SCOPE} {name}"].value == pytest.approx(expected, rel=5e-3)


def test_agrees_with_perktutor_where_the_definitions_do() -> None:
    """Elapsed time, path length and rotation, summed sample by sample as there."""
    times, tips = wander(4.0)
    axes = swaying(times)
    scope = track(times, tips, axes)
    # a cutoff that leaves recorded samples nearly as they are, but at the ends
    sharp = Settings(cutoff_hz=49.0, filter_order=8)
    measured = of_scope(scope, settings=sharp)
    elapsed = path = turned = 0.0
    matrices = Rotation.from_quat(scope.quaternion).as_matrix()
    for i in range(1, len(times)):
        elapsed += times[i] - times[i - 1]
        path += math.dist(tips[i], tips[i - 1])
        cosine = (np.trace(matrices[i] @ matrices[i - 1].T) - 1) / 2
        angle = math.degrees(math.acos(min(1.0, cosine)))
        turned += min(angle, 360 - angle)
    assert task_time_s(measured, SCOPE).value == pytest.approx(elapsed)
    assert raw_path_mm(measured, SCOPE).value == pytest.approx(path)
    assert path_mm(measured, SCOPE).value == pytest.approx(path, rel=3e-4)
    assert rotation_deg(measured, SCOPE).value == pytest.approx(turned, rel=3e-4)
