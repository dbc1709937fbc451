"""Who does nothing in an exercise of the curriculum gets nothing for it."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paravol.session_scoring import rubric_for
from scenarios import load_scenario
from scenarios.metrics import DEFINITIONS, Metric
from scenarios.passing import goals_of
from scenarios.rubrics import Evidence, Rubric, Verdict, assess
from scenarios.scenario import CURRICULUM, Scenario
from scenarios.scoring import OperationFigures
from scenarios.tasks import TaskState
from scenarios.tasks.engine import Status
from scenarios.tasks.task import Remove

NAMES = sorted(file.stem for file in CURRICULUM.glob("*.toml"))


def best(rubric: Rubric) -> list[Metric]:
    """Return every metric at the value that the rubric gives most for."""
    wished = {
        (item.metric, item.role): max(item.bands, key=lambda knot: knot[1])[0]
        for item in rubric.items
    }
    return [
        Metric(d.name, d.role, d.unit, wished.get((d.name, d.role), 0.0))
        for d in DEFINITIONS
    ]


def untouched(scenario: Scenario) -> list[TaskState]:
    """Return how tasks end where nobody does anything: what is kept is done."""
    goals = goals_of(scenario)
    return [
        TaskState(task.name, Status.OPEN if task.name in goals else Status.DONE)
        for task in scenario.tasks
    ]


@pytest.mark.parametrize("has_cuts", [False, True])
@pytest.mark.parametrize("name", NAMES)
@given(way_mm=st.floats(0.0, 1000.0), seconds=st.floats(0.0, 29.0))
@settings(max_examples=20)
def test_nothing_done_gives_no_points(
    name: str, has_cuts: bool, way_mm: float, seconds: float
) -> None:
    scenario, _ = load_scenario(name)
    rubric = rubric_for(scenario, has_cuts=has_cuts)
    flown = {"path length": way_mm, "task time": seconds}
    metrics = [replace(m, value=flown.get(m.name, m.value)) for m in best(rubric)]
    evidence = Evidence(
        "a.paravol",
        name,
        metrics,
        (0.0, seconds),
        untouched(scenario),
        operation=OperationFigures(),
        exercise=scenario,
    )
    found = assess(rubric, evidence)
    assert found.percent == (None if way_mm < rubric.least_path_mm else 0.0)
    assert found.verdict is Verdict.NOT_PASSED
    for part in found.parts:
        if part.source == "task time":
            assert part.points == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_an_operation_is_judged_as_one_whether_anything_was_cut_or_not(
    name: str,
) -> None:
    """An uncinectomy without a cut was judged as an endoscopy."""
    scenario, _ = load_scenario(name)
    rubric = rubric_for(scenario, has_cuts=False)
    is_operation = bool(scenario.tools)
    assert rubric.name == ("operation" if is_operation else "endoscopy")
    assert rubric_for(scenario, has_cuts=True).name == "operation"
    # what is wanted taken is what the exercise wants, no other one's tissue
    wanted = set(rubric.settings.wanted_mm3)
    asked = {
        tissue
        for task in scenario.tasks
        if isinstance(task, Remove)
        for tissue, limits in task.tissues.items()
        if limits.least_mm3 > 0.0
    }
    assert wanted == asked
