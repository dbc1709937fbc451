"""What a session was worth, and how it enters the progress store."""

from dataclasses import replace
from pathlib import Path

import pytest

from paravol.progress.store import ProgressStore
from paravol.scoring.session_scoring import wanted_metrics
from paravol.trainee.session_result import ResultOrder, quick_metrics, result_of_session
from scenarios import Scenario
from scenarios.rubrics import load_rubric
from scenarios.scenario import MetricLimit, PassMarks
from scenarios.tasks import Status
from tests.paravol.trainee import hoops_flight


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return hoops_flight.record(tmp_path_factory.mktemp("flown") / "a.paravol")


def test_a_result_is_kept_with_its_points_and_the_exercises_own_verdict(
    flown: Path, tmp_path: Path
) -> None:
    store = tmp_path / "p.sqlite"
    told: list[str] = []
    order = ResultOrder(flown, "ann", store=store, patient=hoops_flight.scene()[1])
    result = result_of_session(order, lambda stage, _: told.append(stage))
    assert result.is_kept
    assert told
    (entry,) = ProgressStore(store).sessions()
    assert (entry.trainee, entry.exercise) == ("ann", "hoops")
    assert entry.scored is not None
    assert entry.scored.percent == result.assessment.percent
    # the rings were not passed, whatever a rubric for other flights says
    assert [task.status for task in result.score.tasks] != [Status.DONE]
    assert result.has_passed is False
    assert entry.has_passed is False
    assert False in [mark.is_met for mark in result.marks]
    assert any("six rings" in advice.title for advice in result.advice)
    again = result_of_session(replace(order, trainee="bob", has_store=False))
    assert (again.is_kept, again.score) == (False, result.score)
    assert "left out" in again.kept
    assert ProgressStore(store).trainees() == ["ann"]


def test_a_store_that_refuses_costs_no_result(flown: Path, tmp_path: Path) -> None:
    store = tmp_path / "p.sqlite"
    store.write_text("no store")
    patient = hoops_flight.scene()[1]
    result = result_of_session(ResultOrder(flown, store=store, patient=patient))
    assert not result.is_kept
    assert "p.sqlite" in result.kept
    assert store.read_text() == "no store"


def test_what_the_exercise_asks_for_is_measured_however_long_it_takes() -> None:
    rubric = load_rubric("endoscopy")
    quick = {d.name for d in quick_metrics(Scenario("s", "S"), rubric)}
    assert {"economy of motion", "touched area"}.isdisjoint(quick)
    assert {d.name for d in wanted_metrics(rubric, Scenario("s", "S"))} <= quick
    marks = PassMarks(metrics=(MetricLimit("economy of motion", least=0.5),))
    asked = {d.name for d in quick_metrics(Scenario("s", "S", marks=marks), rubric)}
    assert asked - quick == {"economy of motion"}
