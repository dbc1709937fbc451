"""An exercise is passed where all that it asks for is met, and says what is not."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios import load_scenario
from scenarios.metrics import Metric
from scenarios.passing import limited_metrics
from scenarios.rubrics import ExerciseMark, Verdict, exercise_mark
from scenarios.scenario import CURRICULUM, MetricLimit, PassMarks, Scenario
from scenarios.tasks import TaskState
from scenarios.tasks.engine import Status
from scenarios.tasks.task import Reach

DONE, OPEN = TaskState("go", Status.DONE), TaskState("go", Status.OPEN)


def exercise(*limits: MetricLimit, least_percent: float = 0.0) -> Scenario:
    task = Reach(name="go", title="Go", place="choana", radius_mm=2.0)
    marks = PassMarks(metrics=limits, least_percent=least_percent)
    return Scenario(name="e", title="E", tasks=(task,), marks=marks)


def metric(name: str, value: float | None, **more: object) -> Metric:
    return Metric(name, "scope", "mm", value, **more)  # type: ignore[arg-type]


def marked(
    asked: Scenario, tasks: list[TaskState], rows: list[Metric], percent: float | None
) -> ExerciseMark:
    mark = exercise_mark(asked, tasks, rows, percent)
    assert mark is not None
    return mark


@given(
    value=st.floats(-1e3, 1e3),
    least=st.none() | st.floats(-1e3, 1e3),
    most=st.none() | st.floats(-1e3, 1e3),
)
def test_a_limit_is_met_within_its_bounds_and_nowhere_else(
    value: float, least: float | None, most: float | None
) -> None:
    limit = MetricLimit("depth", "scope", least, most)
    mark = marked(exercise(limit), [DONE], [metric("depth", value)], None)
    is_met = (least is None or value >= least) and (most is None or value <= most)
    assert mark.verdict is (Verdict.PASSED if is_met else Verdict.NOT_PASSED)
    told = mark.kept if is_met else mark.missed
    assert any(why.startswith("depth: ") for why in told)


def test_of_several_each_has_to_keep_the_limit() -> None:
    rows = [metric("dose: orbit", 1.0), metric("dose: carotid", 9.0)]
    limit = MetricLimit("dose", most=5.0)
    mark = marked(exercise(limit), [DONE], rows, None)
    assert mark.verdict is Verdict.NOT_PASSED
    assert mark.missed == ("dose: carotid: 9 mm, at most 5 is allowed",)
    one = marked(exercise(MetricLimit("dose: orbit", most=5.0)), [DONE], rows, 0)
    assert one.verdict is Verdict.PASSED


def test_what_is_missed_decides_before_what_is_unknown() -> None:
    unknown = exercise(MetricLimit("depth", most=1.0))
    for tasks, verdict in (([DONE], Verdict.NO_DATA), ([OPEN], Verdict.NOT_PASSED)):
        mark = marked(unknown, tasks, [], None)
        assert mark.verdict is verdict
    mark = marked(exercise(), [], [], None)
    assert mark.verdict is Verdict.NO_DATA


def test_a_hazard_that_nothing_came_near_keeps_its_distance() -> None:
    far = metric("smallest distance: eye", None, reason="nothing came nearer than 24")
    for limit, verdict in (
        (MetricLimit("smallest distance", least=2.0), Verdict.PASSED),
        (MetricLimit("smallest distance", most=2.0), Verdict.NO_DATA),
    ):
        mark = marked(exercise(limit), [DONE], [far], None)
        assert mark.verdict is verdict


@pytest.mark.parametrize(
    ("percent", "verdict"),
    [(None, Verdict.NO_DATA), (59.9, Verdict.NOT_PASSED), (60.0, Verdict.PASSED)],
)
def test_a_percent_of_the_points_may_be_asked_for(
    percent: float | None, verdict: Verdict
) -> None:
    mark = marked(exercise(least_percent=60.0), [DONE], [], percent)
    assert mark.verdict is verdict


def test_a_value_nearer_to_its_limit_than_its_noise_says_so() -> None:
    limit = MetricLimit("depth", most=1.0)
    near = marked(exercise(limit), [DONE], [metric("depth", 0.9, sigma=0.3)], 0)
    assert near.verdict is Verdict.PASSED
    assert "nearer to it than its noise" in near.kept[-1]


def test_an_exercise_that_asks_for_nothing_has_no_mark() -> None:
    nothing = msgspec.structs.replace(exercise(), tasks=())
    assert exercise_mark(nothing, [], [], 100.0) is None


def test_the_limits_of_the_curriculum_name_metrics() -> None:
    for file in CURRICULUM.glob("*.toml"):
        scenario, _ = load_scenario(str(file))
        asks = bool(scenario.marks.metrics or scenario.tools)
        assert bool(limited_metrics(scenario)) == asks
