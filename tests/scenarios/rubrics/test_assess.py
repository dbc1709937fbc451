"""What an assessment must always hold, whatever the metrics are."""

import itertools
from dataclasses import replace

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.metrics import Metric, Settings
from scenarios.rubrics import Evidence, Population, Rubric, Standing, Verdict, assess
from scenarios.rubrics.assess import merged
from scenarios.rubrics.assessment import Assessment
from scenarios.rubrics.population import Group, Quantiles
from scenarios.rubrics.rubric import MOST_REMOVAL_PERCENT, Combine, FailRule, Item
from scenarios.scenario import MetricLimit, PassMarks, Scenario
from scenarios.scoring import InjuryFigure, OperationFigures
from scenarios.tasks import TaskState
from scenarios.tasks.engine import Status
from scenarios.tasks.task import KeepAway, Reach

DOWN = ((0.0, 100.0), (100.0, 0.0))

WAY = Item(
    name="way", title="Way", metric="path length", role="scope", points=60, bands=DOWN
)
TAKEN = Item(
    name="taken",
    title="Taken",
    metric="tissue removed",
    points=30,
    bands=((0.0, 0.0), (50.0, 100.0), (90.0, 0.0)),
)
TASKS = Item(
    name="done", title="Done", task="*", points=10, bands=((0.0, 0.0), (1.0, 100.0))
)
HURT = FailRule(
    name="hurt", title="Hurt", metric="breaches", above=0.0, most_percent=25.0
)
RUBRIC = Rubric("test", 2, "Test", 100.0, 60.0, (WAY, TAKEN, TASKS), (HURT,))

PATH = Metric("path length", "scope", "mm", 40.0, sigma=2.0, intervals=((0.0, 9.0),))
VOLUME = Metric("tissue removed: in all", "patient", "mm3", 50.0)
UNHURT = Metric("breaches: any", "patient", "count", 0.0)
DONE = TaskState("reach", Status.DONE, 1.0, 1.0, 5.0)
FAILED = TaskState("keep", Status.FAILED, 0.9, 0.0, 3.0, "too near")


def evidence(*metrics: Metric, tasks: tuple[TaskState, ...] = (DONE,)) -> Evidence:
    return Evidence("a.paravol", "flight", metrics, (0.0, 9.0), tasks)


ALL = evidence(PATH, VOLUME, UNHURT)


def test_points_add_up_and_name_their_moments() -> None:
    found = assess(RUBRIC, ALL)
    assert [part.points for part in found.parts] == pytest.approx([36.0, 30.0, 10.0])
    assert found.percent == pytest.approx(76.0)
    assert found.percent_sigma == pytest.approx(1.2, rel=1e-3)
    assert found.parts[0].intervals == ((0.0, 9.0),)
    assert found.parts[2].intervals == ((1.0, 5.0),)
    assert found.verdict is Verdict.PASSED
    assert (found.rubric, found.rubric_version) == ("test", 2)
    assert found.rubric_sha256 == RUBRIC.sha256()


def test_it_survives_json_to_the_bit() -> None:
    found = assess(RUBRIC, ALL)
    assert msgspec.json.decode(msgspec.json.encode(found), type=Assessment) == found


values = st.none() | st.floats(-10, 1e4)


@given(values, values, values, st.floats(0, 50), st.booleans())
def test_the_total_is_bounded_and_removal_never_dominates(
    way: float | None, taken: float | None, hurt: float | None, s: float, noise: bool
) -> None:
    found = assess(
        RUBRIC,
        evidence(
            replace(PATH, value=way, sigma=s, floor=1e5 if noise else None),
            replace(VOLUME, value=taken),
            replace(UNHURT, value=hurt),
        ),
    )
    for part in found.parts:
        assert 0.0 <= part.points <= part.most_points
        assert part.counts == (part.standing is Standing.SCORED)
        if part.value is None:
            assert part.points == 0.0
    counted = sum(p.weight * p.most_points for p in found.parts if p.counts)
    removal = sum(
        p.weight * p.most_points for p in found.parts if p.counts and p.is_removal
    )
    assert removal <= counted * MOST_REMOVAL_PERCENT / 100.0 + 1e-9
    if found.percent is not None:
        assert 0.0 <= found.percent <= 100.0
        if hurt is not None and hurt > 0.0:
            assert found.percent <= HURT.most_percent
            assert [fail.name for fail in found.fails] == ["hurt"]


@given(st.floats(0, 49), st.floats(0.1, 50))
def test_a_longer_way_never_gives_more(way: float, more: float) -> None:
    first = assess(RUBRIC, evidence(replace(PATH, value=way), VOLUME, UNHURT))
    second = assess(RUBRIC, evidence(replace(PATH, value=way + more), VOLUME, UNHURT))
    assert first.percent is not None
    assert second.percent is not None
    assert first.percent >= second.percent


def test_what_is_below_the_noise_floor_is_grey_and_does_not_count() -> None:
    quiet = replace(PATH, value=5.0, floor=4.0, sigma=1.0)
    found = assess(RUBRIC, evidence(quiet, VOLUME, UNHURT))
    assert found.parts[0].standing is Standing.BELOW_NOISE
    assert not found.parts[0].counts
    assert found.parts[0].value == 5.0
    assert found.percent is None  # removal alone would make the total
    assert found.verdict is Verdict.NO_DATA


def test_near_the_mark_noise_leaves_it_open() -> None:
    near = replace(PATH, value=66.0, sigma=10.0)
    found = assess(RUBRIC, evidence(near, VOLUME, UNHURT))
    assert found.verdict is Verdict.UNDECIDED
    sure = replace(near, sigma=0.01)
    assert assess(RUBRIC, evidence(sure, VOLUME, UNHURT)).verdict is Verdict.PASSED


def test_tasks_count_what_was_done_and_say_why_not() -> None:
    found = assess(RUBRIC, evidence(PATH, VOLUME, UNHURT, tasks=(DONE, FAILED)))
    part = found.parts[2]
    assert part.value == 0.5
    assert "too near" in part.reason
    assert part.intervals == ((0.0, 5.0),)
    named = msgspec.structs.replace(TASKS, task="reech")
    rubric = msgspec.structs.replace(RUBRIC, items=(WAY, TAKEN, named))
    assert "did you mean 'reach'" in assess(rubric, ALL).parts[2].reason


def hazard(name: str, value: float | None, reason: str = "") -> Metric:
    return Metric(f"smallest distance: {name}", "scope", "mm", value, reason)


@pytest.mark.parametrize(
    ("combine", "expected"),
    [(Combine.SMALLEST, 2.0), (Combine.LARGEST, 5.0), (Combine.SUM, 7.0)],
)
def test_values_of_many_hazards_become_one(combine: Combine, expected: float) -> None:
    item = Item(
        name="near",
        title="Near",
        metric="smallest distance",
        role="scope",
        combine=combine,
        points=100,
        bands=((0.0, 0.0), (10.0, 100.0)),
    )
    rubric = Rubric("r", 1, "R", 100.0, 50.0, (item,))
    far = hazard("eye", None, "nothing came nearer than 24 mm")
    rows = hazard("orbit", 5.0), hazard("artery", 2.0), far
    assert assess(rubric, evidence(*rows)).parts[0].value == expected
    alone = assess(rubric, evidence(far)).parts[0]
    assert alone.standing is Standing.SCORED
    assert alone.points == 100.0
    one = msgspec.structs.replace(item, of="orbitt")
    part = assess(msgspec.structs.replace(rubric, items=(one,)), evidence(*rows))
    assert "did you mean 'orbit'" in part.parts[0].reason


def test_figures_of_an_operation_span_all_of_it() -> None:
    item = Item(name="b", title="B", figure="bled_ml", points=100, bands=DOWN)
    rubric = Rubric("r", 1, "R", 100.0, 50.0, (item,))
    assert assess(rubric, ALL).parts[0].standing is Standing.NO_DATA
    bled = ALL._replace(operation=OperationFigures(bled_ml=25.0))
    part = assess(rubric, bled).parts[0]
    assert (part.points, part.intervals) == (75.0, ((0.0, 9.0),))


def test_bands_are_shown_only_where_they_can_be_compared() -> None:
    group = Group("expert", 9, {"scope/path length": Quantiles(10, 20, 30, 9)})
    population = Population("generated", True, "flight", 1, Settings(), (group,))
    with_bands = assess(RUBRIC, ALL, population)
    band = with_bands.parts[0].bands[0]
    assert (band.group, band.low, band.high, band.source) == (
        *("expert", 10, 30),
        "generated",
    )
    assert with_bands.percent == assess(RUBRIC, ALL).percent
    elsewhere = assess(RUBRIC, ALL._replace(scenario="other"), population)
    assert elsewhere.parts[0].bands == ()
    assert "No bands" in elsewhere.remarks[0]


@given(st.lists(st.tuples(st.floats(0, 9), st.floats(0, 9)).map(sorted)))
def test_merged_intervals_are_apart_and_cover_the_same(
    spans: list[list[float]],
) -> None:
    pairs = [(a, b) for a, b in spans]
    found = merged(pairs)
    assert all(a[1] < b[0] for a, b in itertools.pairwise(found))
    for begin, end in pairs:
        assert any(a <= begin and end <= b for a, b in found)


def asked(*names: str, limits: tuple[MetricLimit, ...] = ()) -> Scenario:
    """An exercise of so many places to reach, and one thing to keep away from."""
    tasks: list[Reach | KeepAway] = [
        Reach(name=name, title=name, place="choana", radius_mm=2.0) for name in names
    ]
    safe = KeepAway(
        name="safe", title="Safe", hazards=("orbit",), margin_mm=1.0, most_dose_s=1.0
    )
    marks = PassMarks(metrics=limits)
    return Scenario("e", "E", tasks=(*tasks, safe), marks=marks)


PLAIN = msgspec.structs.replace(RUBRIC, items=(WAY, TAKEN), total_points=90.0)
SAFE = TaskState("safe", Status.DONE, 1.0)

statuses = st.tuples(st.sampled_from(Status), st.floats(0.0, 1.0))


@given(st.lists(statuses, min_size=1, max_size=8), st.none() | st.floats(0, 100))
def test_completeness_weighs_and_the_verdict_is_one(
    reached: list[tuple[Status, float]], way: float | None
) -> None:
    states = [
        TaskState(f"{n}", status, 1.0 if status is Status.DONE else progress)
        for n, (status, progress) in enumerate(reached)
    ]
    exercise = asked(*(state.name for state in states))
    seen = evidence(replace(PATH, value=way), VOLUME, UNHURT, tasks=(*states, SAFE))
    found = assess(PLAIN, seen._replace(exercise=exercise))
    finished = [state.status is Status.DONE for state in states]
    assert found.done is not None
    assert (found.done.done, found.done.asked) == (sum(finished), len(states))
    assert found.exercise is not None
    assert found.verdict is found.exercise.verdict
    assert (found.verdict is Verdict.PASSED) == all(finished)
    if found.percent is not None:
        assert found.flown_percent is not None
        assert found.percent == pytest.approx(found.flown_percent * found.done.share)
        begun = sum(state.status is Status.OPEN for state in states)
        assert found.percent <= 100.0 * (sum(finished) + begun) / len(states) + 1e-9


def test_who_only_keeps_away_has_done_nothing() -> None:
    states = (TaskState("go"), SAFE)
    seen = evidence(PATH, VOLUME, UNHURT, tasks=states)._replace(exercise=asked("go"))
    assert assess(PLAIN, seen).percent == 0.0
    near = MetricLimit("nearest to: choana", most=10.0)
    flown = seen._replace(exercise=Scenario("e", "E", marks=PassMarks(metrics=(near,))))
    for nearest_mm, percent in ((9.0, 100.0), (11.0, 0.0)):
        came = Metric("nearest to: choana", "scope", "mm", nearest_mm)
        found = assess(
            msgspec.structs.replace(PLAIN, items=(WAY,)),
            flown._replace(metrics=(replace(PATH, value=0.0), came)),
        )
        assert found.percent == percent


@pytest.mark.parametrize("status", list(Status))
def test_to_be_quick_counts_for_whoever_has_done_it(status: Status) -> None:
    quick = msgspec.structs.replace(WAY, when_done=True)
    rubric = msgspec.structs.replace(PLAIN, items=(quick, TAKEN))
    states = (TaskState("go", status, 0.5), SAFE)
    seen = evidence(PATH, VOLUME, UNHURT, tasks=states)._replace(exercise=asked("go"))
    part = assess(rubric, seen).parts[0]
    assert part.counts
    assert (part.points > 0.0) == (status is Status.DONE)
    assert bool(part.withheld) == (status is not Status.DONE)


def test_an_injury_takes_the_points_for_keeping_away() -> None:
    away = Item(
        name="away",
        title="Away",
        metric="hazard dose",
        role="scope",
        points=60,
        bands=DOWN,
    )
    rubric = msgspec.structs.replace(PLAIN, items=(away, TAKEN))
    dose = Metric("hazard dose: orbit", "scope", "s", 0.0)
    hurt = InjuryFigure(3.0, "septum", "", "right", [0.0, 0.0, 0.0], 2.8, "curette")
    for injuries, points in (([], 60.0), ([hurt], 0.0)):
        seen = evidence(dose, VOLUME, UNHURT)
        operation = OperationFigures(injuries=injuries)
        part = assess(rubric, seen._replace(operation=operation)).parts[0]
        assert part.points == points
        assert part.withheld == ("septum was hurt" if injuries else "")


def test_who_hurt_somebody_has_not_passed_whatever_was_done() -> None:
    states = (TaskState("go", Status.DONE, 1.0), SAFE)
    seen = evidence(PATH, VOLUME, replace(UNHURT, value=1.0), tasks=states)
    found = assess(PLAIN, seen._replace(exercise=asked("go")))
    assert found.exercise is not None
    assert found.verdict is Verdict.NOT_PASSED
    assert found.exercise.missed == (found.fails[0].why,)


@given(st.floats(0.0, 100.0), st.floats(0.0, 100.0))
def test_too_little_of_a_flight_is_not_judged(scope_mm: float, tool_mm: float) -> None:
    rubric = msgspec.structs.replace(PLAIN, least_path_mm=20.0)
    ways = replace(PATH, value=scope_mm), replace(PATH, role="tool", value=tool_mm)
    done = TaskState("go", Status.DONE, 1.0), SAFE
    seen = evidence(*ways, VOLUME, UNHURT, tasks=done)._replace(exercise=asked("go"))
    found = assess(rubric, seen)
    is_judged = max(scope_mm, tool_mm) >= 20.0
    assert (found.percent is not None) == is_judged
    assert (found.verdict is Verdict.PASSED) == is_judged
    if not is_judged:
        assert found.remarks[0].startswith("Too little was flown to be judged")
        assert not any(part.points for part in found.parts)
