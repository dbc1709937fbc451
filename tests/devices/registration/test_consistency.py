import numpy as np
import pytest
from scipy.stats import binom

from devices.registration.consistency import (
    DOUBTED_CHANCE,
    REFUSED_CHANCE,
    Consistency,
    landmark_consistency,
)
from devices.registration.target_error import PointErrors, moves
from tests.slow_cases import slow

POINTS = np.array(
    [[0.0, -80, 40], [60.0, -30, -5], [-60.0, -30, -5], [0.0, -70, -40], [5, -85, 10]]
)


def errors(count: int) -> PointErrors:
    """Unequal errors with two shared causes that bend the set."""
    rng = np.random.default_rng(3)
    noise = np.array([np.diag(rng.uniform(0.01, 0.09, 3)) for _ in range(count)])
    return PointErrors(noise, 0.3 * rng.normal(size=(count, 3, 2)))


def drawn(rng: np.random.Generator, found: PointErrors) -> np.ndarray:
    """Return what a fit leaves of errors like these, (n, 3)."""
    count = len(found.noise)
    own = np.array([rng.multivariate_normal(np.zeros(3), n) for n in found.noise])
    off = own + found.common @ rng.normal(size=2)
    rows = moves(POINTS[:count], POINTS[:count].mean(axis=0)).reshape(-1, 6)
    # any fit leaves the same statistic; here an unweighted one
    fitted = rows @ np.linalg.lstsq(rows, off.ravel())[0]
    return (off.ravel() - fitted).reshape(-1, 3)


@pytest.mark.parametrize("count", [3, *slow(4, 5)])
def test_sound_sets_are_doubted_as_often_as_is_said(count: int) -> None:
    rng = np.random.default_rng(count)
    found, draws = errors(count), 4000
    judged = [
        landmark_consistency(POINTS[:count], drawn(rng, found), found).whole
        for _ in range(draws)
    ]
    assert {one.freedom for one in judged} == {3 * count - 6}
    for chance in (REFUSED_CHANCE, DOUBTED_CHANCE, 0.5):
        alarms = sum(one.chance < chance for one in judged)
        least, most = binom.interval(0.9999, draws, chance)
        assert least <= alarms <= most
    assert np.mean([one.statistic for one in judged]) == pytest.approx(
        3 * count - 6, rel=0.05
    )


def test_the_slipped_point_is_found() -> None:
    rng = np.random.default_rng(0)
    found = errors(5)
    for slipped in range(5):
        off = drawn(rng, found)
        off[slipped] += (0.0, 2.5, 1.5)
        judged = landmark_consistency(POINTS, off, found)
        assert judged.whole.chance < REFUSED_CHANCE
        assert judged.culprit == slipped
        assert judged.without[slipped].freedom == 6


def test_no_point_is_blamed_for_all() -> None:
    found = errors(5)
    judged = landmark_consistency(
        POINTS, 10.0 * drawn(np.random.default_rng(1), found), found
    )
    assert judged.whole.chance < REFUSED_CHANCE
    assert judged.culprit is None


def test_three_points_cannot_tell_which_is_wrong() -> None:
    found = errors(3)
    off = drawn(np.random.default_rng(2), found) * 30.0
    assert landmark_consistency(POINTS[:3], off, found).culprit is None


def test_the_ratio_of_birge() -> None:
    assert Consistency(24.0, 6).ratio == pytest.approx(2.0)
    # well within what chance leaves
    assert Consistency(9.0, 6).ratio == 1.0
    assert Consistency(0.0, 6).ratio == 1.0
    assert Consistency(0.0, 0).chance == 1.0
    assert Consistency(0.0, 0).ratio == 1.0
