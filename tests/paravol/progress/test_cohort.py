"""Trainees beside one another."""

import pytest

from paravol.progress.cohort import is_more_better, standings
from tests.paravol.progress.learners import entry

ENTRIES = [
    entry("ann", 1, path_mm=300.0, percent=50.0, has_passed=False),
    entry("ann", 2, path_mm=200.0, percent=70.0, has_passed=True),
    entry("ann", 3, path_mm=220.0, percent=66.0),
    entry("bob", 4, path_mm=400.0, percent=80.0, has_passed=True),
    entry("cyd", 5, path_mm=100.0, percent=20.0, has_passed=False),
    entry("cyd", 6, exercise="tunnel", path_mm=None),
]


def test_medians_bests_and_passes_by_trainee_and_exercise() -> None:
    rows = {(r.trainee, r.exercise): r for r in standings(ENTRIES, "path length")}
    assert list(rows) == [
        *(("ann", "hoops"), ("bob", "hoops"), ("cyd", "hoops"), ("cyd", "tunnel"))
    ]
    ann = rows["ann", "hoops"]
    assert (ann.attempts, ann.judged, ann.passes) == (3, 2, 1)
    assert (ann.middle, ann.best, ann.unit) == (220.0, 200.0, "mm")
    assert ann.last_seen.startswith("2026-03-03")
    none = rows["cyd", "tunnel"]
    assert (none.middle, none.best, none.percentile) == (None, None, None)


def test_the_best_has_the_highest_percentile_whichever_way_it_counts() -> None:
    """Of three: 5/6, 3/6 and 1/6 of the way, ties in the middle."""
    short = standings(ENTRIES[:5], "path length")
    assert [r.percentile for r in short] == pytest.approx([50.0, 100 / 6, 500 / 6])
    points = standings(ENTRIES[:5], "percent")
    assert [r.percentile for r in points] == pytest.approx([50.0, 500 / 6, 100 / 6])
    assert [r.best for r in points] == [70.0, 80.0, 20.0]
    assert standings(ENTRIES[:3], "percent")[0].percentile is None


def test_it_is_known_of_which_figures_more_is_better() -> None:
    assert is_more_better("smallest distance: orbit")
    assert is_more_better("SPARC")
    assert not is_more_better("path length, raw")
    assert not is_more_better("hazard dose: orbit")
