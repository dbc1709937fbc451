"""Laws of the curriculum over drawn heads: a task is met by doing it, and only so."""

import math
from collections.abc import Iterator
from functools import cache

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from anatomy.phantom.phantom import build_phantom
from anatomy.phantom.population import draw_parameters
from anatomy.tissue import Label
from renderers.scene import AirSurface
from scenarios import Scenario, Structures, load_scenario, tip_frame
from scenarios.endoscope import Endoscope
from scenarios.exercise_check import untouched_problems
from scenarios.scenario import CURRICULUM
from scenarios.tasks.head_parts import Head
from scenarios.tasks.neck import DEEP_MM, Neck
from scenarios.tasks.rules import rule_of
from scenarios.tasks.situation import Situation
from scenarios.tasks.task import KeepAway, Limits, Open, Remove, Share, Task
from surgery.decongestion import decongest
from surgery.edit import CuttingLimits
from surgery.patient import OperatedPatient
from surgery.solids import capsule

OPERATIONS = (
    "uncinectomy",
    "maxillary-antrostomy",
    "polypectomy",
    "anterior-ethmoidectomy",
    "sphenoidotomy",
)
SEEDS = range(1, 21)
FIELD_MM = ((-32.0, 2.0), (-14.0, 76.0), (4.0, 56.0))
"""The right side of nose and sinuses, but for their outer ends."""

BITES, FAR_MM, JAW_MM = 40, 6.0, 1.3
"""Bites anywhere but at the goal; so far from it; half their width."""

Places = dict[str, NDArray[np.float64]]


@cache
def drawn(seed: int) -> tuple[OperatedPatient, Head, Places]:
    """Return the right side of a drawn patient, decongested, as exercises have it."""
    phantom = build_phantom(draw_parameters(seed), 0.5, field_mm=FIELD_MM)
    places = {n: np.asarray(m.position_mm) for n, m in phantom.landmarks.items()}
    surface = decongest(
        AirSurface(phantom.distance, phantom.blood, phantom.skin), phantom.labels
    )
    names = {int(v): v.name.lower().replace("_", " ") for v in Label}
    structures = Structures.of(surface.distance, phantom.labels, names, places)
    patient = OperatedPatient(surface, phantom.layers, phantom.labels)
    return patient, Head(surface.distance, structures), places


def now(patient: OperatedPatient) -> Situation:
    away = tip_frame(np.full(3, 1e4), np.array([0.0, 1.0, 0.0]))
    camera = Endoscope().camera(away, 0.0, (8, 8))
    return Situation(
        0.0,
        away[:3, 3],
        camera,
        patient.surface.distance,
        edits=patient.edits,
        books=patient.books,
        fill=patient.fill,
    )


def asking(head: Head) -> Iterator[tuple[str, Task]]:
    """Yield the tasks of operations that ask for tissue which the head has."""
    for name in OPERATIONS:
        for task in load_scenario(name)[0].tasks:
            if isinstance(task, Open):
                yield name, task
            elif isinstance(task, Remove) and task.asks:
                assert not task.tissues
                assert not task.walls
                if all(head.part(part) is not None for part in task.parts):
                    yield name, task


def goal_of(task: Task, head: Head, places: Places) -> NDArray[np.float64]:
    if isinstance(task, Open):
        start, end = places[str(task.start)], places[str(task.end)]
        return Neck.between(head.distance, start, end).middle[None]
    assert isinstance(task, Remove)
    parts = [head.part(name) for name in task.parts]
    return np.concatenate([head.places(part.voxels) for part in parts if part])


@pytest.mark.parametrize(
    "seed", [s if s < 2 else pytest.param(s, marks=pytest.mark.slow) for s in SEEDS]
)
def test_no_task_is_met_on_an_untouched_head_nor_by_bites_elsewhere(seed: int) -> None:
    patient, head, places = drawn(seed)
    random = np.random.default_rng(seed)
    distance = head.distance
    bare = np.flatnonzero(np.abs(distance.values.reshape(-1)) < 0.3)
    surface = head.places(bare[:: max(len(bare) // 20_000, 1)])
    count = 0
    for name, task in asking(head):
        rule = rule_of(task, places, head)
        rule.step(now(patient), 0.0)
        assert rule.progress < 0.9, (name, task.name, rule.lacks)
        untouched = rule.progress
        apart, _ = cKDTree(goal_of(task, head, places)).query(surface)
        for place in random.permutation(surface[apart > FAR_MM])[:BITES]:
            way = random.normal(size=3)
            end = place + 1.5 * way / np.linalg.norm(way)
            patient.carve(capsule(place, end, JAW_MM), CuttingLimits(1e3, 1e3))
        assert patient.books.counts > 0
        rule.step(now(patient), 0.0)
        assert rule.progress < 1.0, (name, task.name, rule.lacks)
        assert rule.progress - untouched < 0.05, (name, task.name, rule.lacks)
        while patient.undo() is not None:
            pass
        count += 1
    assert count >= 6


@pytest.mark.parametrize(
    "seed", [s if s < 2 else pytest.param(s, marks=pytest.mark.slow) for s in SEEDS]
)
def test_an_opening_is_met_by_a_hole_through_its_neck(seed: int) -> None:
    patient, head, places = drawn(seed)
    tasks = [task for _, task in asking(head) if isinstance(task, Open)]
    for task in tasks:
        start, end = places[str(task.start)], places[str(task.end)]
        neck = Neck.between(head.distance, start, end)
        radius_mm = math.sqrt(task.area_mm2 / math.pi) + 0.5
        front, back = (neck.middle + d * neck.normal for d in (-1.0, DEEP_MM))
        rule = rule_of(task, places, head)
        patient.carve(capsule(front, back, radius_mm), CuttingLimits(1e3, 1e3))
        rule.step(now(patient), 0.0)
        assert rule.progress == 1.0, (task.name, rule.lacks)
        patient.undo()
    assert len(tasks) == 2


def test_every_operation_asks_for_completeness_and_for_what_is_spared() -> None:
    for name in OPERATIONS:
        scenario, _ = load_scenario(name)
        by_name = {task.name: task for task in scenario.tasks}
        needed = [by_name[task] for task in scenario.marks.tasks]
        assert any(isinstance(task, KeepAway) for task in needed), name
        spares = [t for t in needed if isinstance(t, Remove) and not t.asks]
        assert spares, name
        for turbinate in ("middle turbinate", "inferior turbinate"):
            assert spares[0].tissues[turbinate].most_mm3 == 5.0, name
        for task in scenario.tasks:
            if isinstance(task, Remove | Open | KeepAway):
                assert task.name in scenario.marks.tasks, (name, task.name)
            for part, share in getattr(task, "parts", {}).items():
                if part.startswith("uncinate"):
                    assert share.least_percent >= 80.0
        kept = {h for t in needed if isinstance(t, KeepAway) for h in t.hazards}
        assert len(kept) == 10, name
        assert [(m.name, m.most) for m in scenario.marks.metrics] == [("breaches", 0)]


def test_an_exercise_that_is_done_before_it_is_begun_is_told() -> None:
    _, head, places = drawn(1)
    asked = Open(
        name="o",
        title="O",
        start="maxillary ostium, right",
        end="maxillary sinus, right",
        radius_mm=1.0,
        area_mm2=30.0,
    )
    assert not list(untouched_problems([asked], head, places))
    gaping = msgspec.structs.replace(asked, area_mm2=8.0)
    (problem,) = untouched_problems([gaping], head, places)
    assert "done before it is begun" in problem.text
    polyp = Remove(name="p", title="P", parts={"polyp, right": Share(80.0)})
    (problem,) = untouched_problems([polyp], head, places)
    assert "This head has no 'polyp, right'" in problem.text
    # what only spares is not done before the end
    spare = Remove(name="s", title="S", tissues={"polyp": Limits(most_mm3=5.0)})
    assert not list(untouched_problems([spare], head, places))


def test_operations_are_those_of_the_curriculum() -> None:
    found = set()
    for file in CURRICULUM.glob("*.toml"):
        scenario: Scenario = load_scenario(str(file))[0]
        if any(isinstance(task, Remove | Open) for task in scenario.tasks):
            found.add(scenario.name)
    assert found == set(OPERATIONS)
