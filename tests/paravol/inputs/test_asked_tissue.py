"""What an exercise asks for, task by task, among the labels of its head."""

import numpy as np
import pytest

from paravol.inputs.asked_tissue import ASKED, LATER, SPARED, asked_tissue
from paravol.patient import load_patient, no_progress
from scenarios import load_scenario
from scenarios.tasks import task as tasks
from scenarios.tasks.head_parts import Head


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
