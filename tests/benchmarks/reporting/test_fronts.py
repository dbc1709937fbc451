"""A front is what nothing beats, among rows that can be compared."""

import msgspec
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.reporting.fronts import comparisons, pareto_front
from benchmarks.schema import Results, Row

POSITIVE = st.floats(1e-6, 1e3)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(places=st.lists(st.tuples(POSITIVE, POSITIVE), min_size=1, max_size=30))
def test_a_front_is_what_no_other_equals_or_beats(
    row: Row, places: list[tuple[float, float]]
) -> None:
    rows = [msgspec.structs.replace(row, cpu_s=t, rmse=e) for t, e in places]
    front = [(row.seconds, row.rmse) for row in pareto_front(rows)]
    for t, e in places:
        beaten = any(u <= t and f <= e and (u, f) != (t, e) for u, f in places)
        assert ((t, e) in front) == (not beaten)
    assert front == sorted(set(front))


def test_only_pictures_of_one_kind_are_compared(results: Results) -> None:
    wall = comparisons(results.rows)[0]
    assert wall.case == "phantom/inside/wall"
    steps = [row.settings["step_voxels"] for row in wall.series["ART"]]
    assert steps == [1.0, 0.5, 0.25]
    finer = [
        msgspec.structs.replace(row, settings=row.settings | {"size": 64})
        for row in wall.rows
    ]
    other = [
        msgspec.structs.replace(row, settings=row.settings | {"reference": "Q"})
        for row in wall.rows
    ]
    apart = comparisons([*wall.rows, *finer, *other])
    assert [len(panel.rows) for panel in apart] == [len(wall.rows)] * 3


def test_threads_are_drawn_and_not_on_the_front(results: Results) -> None:
    wall = comparisons(results.rows)[0]
    assert "ART, two threads" in wall.series
    assert [row.mode for row in wall.front] == [
        "FSR points",
        "ART, step 1",
        "ART, step 0.5",
        "ART, step 0.25",
    ]


def test_who_is_compared_with_itself_is_told(results: Results) -> None:
    wall = comparisons(results.rows)[0]
    told = {"series": "VTK, against itself", "reference": "V", "self_referenced": True}
    own = msgspec.structs.replace(
        wall.rows[0], mode="VTK", settings=wall.rows[0].settings | told
    )
    (panel,) = comparisons([*wall.rows, own])
    assert panel.own_reference == {"VTK, against itself"}
    assert own in panel.rows


def test_a_measurement_of_two_suites_stands_once(results: Results) -> None:
    wall = comparisons(results.rows)[0]
    twice = [msgspec.structs.replace(row, suite="other") for row in wall.rows]
    (panel,) = comparisons([*wall.rows, *twice])
    assert len(panel.rows) == len(wall.rows)


def test_one_row_alone_is_no_comparison(row: Row) -> None:
    told = row.settings | {"reference": "R"}
    assert comparisons([msgspec.structs.replace(row, settings=told)]) == []
