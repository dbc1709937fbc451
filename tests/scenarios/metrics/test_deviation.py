import numpy as np
import pytest

from scenarios.metrics.deviation import (
    DEVIATION,
    POINTS,
    even_points,
    frechet_mm,
    hausdorff_mm,
    warped_mm,
)
from tests.scenarios.metrics.tracks import NO_TRACK, of_scope, track, wander

LINE = np.stack([np.linspace(0, 10, 50), np.zeros(50), np.zeros(50)], axis=1)
ALL = (hausdorff_mm, frechet_mm, warped_mm)


@pytest.mark.parametrize("distance", ALL)
def test_a_parallel_way_is_its_distance_away(distance: object) -> None:
    assert callable(distance)
    assert distance(LINE, LINE) == 0.0
    assert distance(LINE, LINE + np.array([0.0, 3.0, 4.0])) == pytest.approx(5.0)


def test_only_hausdorff_forgets_the_order() -> None:
    assert hausdorff_mm(LINE, LINE[::-1]) == 0.0
    assert frechet_mm(LINE, LINE[::-1]) == pytest.approx(10.0)
    assert warped_mm(LINE, LINE[::-1]) > 1.0


def test_the_coupling_is_the_recursion_of_eiter_and_mannila() -> None:
    rng = np.random.default_rng(4)
    one, other = rng.normal(size=(13, 3)), rng.normal(size=(9, 3))
    away = np.linalg.norm(one[:, None] - other[None], axis=2)

    def recursive(i: int, j: int, *, is_sum: bool) -> float:
        steps = [(i - 1, j), (i, j - 1), (i - 1, j - 1)]
        before = [known[a, b] for a, b in steps if a >= 0 and b >= 0]
        least = min(before, default=0.0)
        here = float(away[i, j])
        return least + here if is_sum else max(least, here)

    for is_sum, told in ((False, frechet_mm), (True, warped_mm)):
        known: dict[tuple[int, int], float] = {}
        for i in range(13):
            for j in range(9):
                known[i, j] = recursive(i, j, is_sum=is_sum)
        expected = known[12, 8] / (13 if is_sum else 1)
        assert told(one, other) == pytest.approx(expected)


def test_pace_and_pauses_do_not_count() -> None:
    times, tips = wander(4.0)
    slow = track(2.0 * times, tips)
    measured = of_scope(track(times, tips), expert=slow)
    for definition in DEVIATION:
        (found,) = definition.answers(measured).values()
        assert found.value == pytest.approx(0.0, abs=0.3)


def test_points_are_even_along_the_way() -> None:
    times, tips = wander(4.0)
    measured = of_scope(track(times, tips))
    points = even_points(measured.scope_pieces)
    assert points is not None
    assert len(points) == POINTS
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.std() < 0.02 * steps.mean()


def test_without_an_expert_or_a_path_the_reason_is_told() -> None:
    times, tips = wander(1.0)
    alone, lost = of_scope(track(times, tips)), of_scope(NO_TRACK, expert=NO_TRACK)
    for measured in (alone, lost):
        for definition in DEVIATION:
            (found,) = definition.answers(measured).values()
            assert found.value is None
            assert found.reason
