"""What an exercise asks for, task by task, among the labels of its head."""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy import ndimage

from paravol.exercises.exercise_path import start_path
from paravol.inputs.asked_tissue import ASKED, LATER, SPARED, asked_tissue, spared_by
from paravol.inputs.hand import nostril_fulcrum
from paravol.inputs.tool_plan import NEAR_MM, ToolPlan, has_jaws, shaves
from paravol.patient import load_patient, no_progress
from renderers.scene import Volume
from scenarios import Structures, load_scenario
from scenarios.endoscope import SUPERIOR
from scenarios.tasks import Task
from scenarios.tasks import task as tasks
from scenarios.tasks.head_parts import Head

H = 0.5
"""Spacing of the exercises' heads, mm."""


@pytest.mark.slow
def test_only_what_the_open_task_asks_for_is_meant() -> None:
    """The bulla lies behind the process: bites at the one do not mean the other."""
    scenario, _ = load_scenario("anterior-ethmoidectomy")
    patient = load_patient(scenario, no_progress)
    asked = asked_tissue(patient, scenario.tasks)
    assert asked is not None
    assert patient.structures is not None
    values = asked.labels.values.reshape(-1)
    head = Head(patient.surface.distance, patient.structures)
    parts = {}
    for task in scenario.tasks:
        if isinstance(task, tasks.Remove) and task.parts:
            found = [head.part(name) for name in task.parts]
            parts[task.name] = np.concatenate(
                [p.voxels for p in found if p is not None]
            )
    assert len(parts) == 3
    whole = np.unique(np.concatenate(list(parts.values())))
    assert np.array_equal(np.flatnonzero(values == ASKED), whole)
    spared = np.flatnonzero(values == SPARED)
    for name in (*parts, "spare", *parts):
        asked.ask(name)
        own = np.unique(parts.get(name, whole))
        assert np.array_equal(np.flatnonzero(values == ASKED), own)
        assert np.array_equal(np.flatnonzero(values == LATER), np.setdiff1d(whole, own))
    assert np.array_equal(np.flatnonzero(values == SPARED), spared)
    asked.ask(None)
    assert np.array_equal(np.flatnonzero(values == ASKED), whole)


def opened_up(
    distance: Volume, named: Structures, head: Head, every: Sequence[Task]
) -> Volume:
    """Return a head's air where all that tasks ask for is away, and 1 mm about it."""
    asked = np.zeros(distance.shape, bool)
    spared = spared_by(every)
    for task in every:
        if isinstance(task, tasks.Remove):
            for name, share in task.parts.items():
                part = head.part(name) if share.least_percent > 0.0 else None
                if part is not None:
                    asked.reshape(-1)[part.voxels] = True
    kept = [number for number, name in named.names.items() if name in spared]
    grown = ndimage.binary_dilation(asked, iterations=round(1.0 / H))
    asked |= grown & ~np.isin(named.labels.values, kept)
    air = (distance.values < 0.0) | asked
    deep = ndimage.distance_transform_edt(air) - 0.5
    away = ndimage.distance_transform_edt(~air) - 0.5
    values = np.where(air, np.minimum(distance.values, -deep * H), away * H)
    return distance.with_values(values.astype(np.float32), distance.background)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["uncinectomy", "polypectomy", "anterior-ethmoidectomy"]
)
def test_tools_get_to_as_much_as_an_operation_asks_for(name: str) -> None:
    """Even with all of it away: what nobody can reach, nobody may be asked for."""
    scenario, _ = load_scenario(name)
    patient = load_patient(scenario, no_progress)
    assert patient.structures is not None
    assert patient.surface.distance.spacing_mm == pytest.approx(np.full(3, H))
    head = Head(patient.surface.distance, patient.structures)
    air = opened_up(patient.surface.distance, patient.structures, head, scenario.tasks)
    path = start_path(patient, scenario.start)
    fulcrum = nostril_fulcrum(patient, path, scenario.start)
    plan = ToolPlan(fulcrum, air, hazards=patient.hazards, layers=patient.layers)
    away = np.eye(4)
    away[:3, 3] = 0.0, -300.0, 0.0
    now = fulcrum.pivot_mm, 0.0
    biting = [t for t in scenario.tools if has_jaws(t) or shaves(t)]
    for task in scenario.tasks:
        if not isinstance(task, tasks.Remove):
            continue
        for part, share in task.parts.items():
            if not share.least_percent:
                continue
            found = head.part(part)
            assert found is not None
            drawn = np.random.default_rng(0).permutation(len(found.voxels))[:60]
            reached = 0
            for place in head.places(found.voxels[drawn]):
                reached += any(
                    plan.choose(
                        *(tool, place, away, 2.0, SUPERIOR, now),
                        is_at_tissue=False,
                        beside=False,
                    ).off_mm
                    <= NEAR_MM
                    for tool in biting
                )
            assert 100.0 * reached / len(drawn) >= share.least_percent, part
