"""Surface seen: the mean over sites by area, its error in squares."""

import math

import pytest

from scenarios.coverage import CoverageFigures, SiteSeen
from scenarios.metrics import Measured, PoseNoise, SessionNoise, definitions_named
from scenarios.metrics.registry import measure
from scenarios.metrics.surface_seen import landmarks_seen, surface_seen
from tests.scenarios.metrics.tracks import of_scope, track, wander

SITES = {
    "septum, left": SiteSeen(300.0, 50.0, 4.0),
    "choana, left": SiteSeen(100.0, 10.0, 8.0),
}


def measured(coverage: CoverageFigures | None) -> Measured:
    return of_scope(track(*wander(2.0)), coverage=coverage)


def test_in_all_is_the_mean_by_area_and_errors_add_in_squares() -> None:
    answer = surface_seen(measured(CoverageFigures(SITES, {})))
    assert not isinstance(answer, tuple)
    assert answer["in all"].value == pytest.approx(40.0)
    assert answer["in all"].sigma == pytest.approx(math.hypot(3.0, 2.0))
    assert answer["choana, left"].value == 10.0


def test_landmarks_are_told_with_the_moments_that_they_were_looked_at() -> None:
    answer = landmarks_seen(measured(CoverageFigures(SITES, {"choana, left": 9.0})))
    assert not isinstance(answer, tuple)
    assert answer["choana, left"].intervals[0] == pytest.approx((8.4, 9.0))


def test_where_nobody_watched_there_is_a_reason() -> None:
    answer = surface_seen(measured(None))
    assert not isinstance(answer, tuple)
    assert answer["in all"].value is None
    assert answer["in all"].reason
    assert landmarks_seen(measured(None)) == {}


def test_its_own_error_bar_stands_whatever_the_device() -> None:
    noise = PoseNoise.even(0.1, 0.001, 0.0, "made up")
    chosen = definitions_named(("surface seen",))
    coverage = CoverageFigures(SITES, {})
    found = measure(measured(coverage), SessionNoise(noise, noise), chosen)
    sigma = {metric.name: metric.sigma for metric in found}
    assert sigma["surface seen: septum, left"] == 4.0
