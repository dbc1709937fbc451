"""The way of a scope into an exercise's head: recorded, or straight from its start."""

from pathlib import Path

import numpy as np

from anatomy.scan.approach import Approach, air_reach
from devices import ProbePath, load_probe_path
from paravol.exercises.case_scenario import straight_path
from paravol.inputs.hand import nostril_fulcrum
from paravol.patient import PatientScene
from scenarios import Scenario
from scenarios.scenario import Start
from system import UserError

STRAIGHT_MM = 60.0
"""Farther nobody goes in straight."""


def recorded_path_file(scenario: Scenario, folder: Path) -> Path | None:
    """Return the file of the exercise's path, None where it has none."""
    return folder / scenario.path if scenario.path else None


def recorded_path(scenario: Scenario, folder: Path) -> ProbePath:
    """Read the exercise's path; UserError where it has none."""
    file = recorded_path_file(scenario, folder)
    if file is None:
        raise UserError(
            f"The exercise {scenario.name!r} has no recorded path to be flown by "
            "itself; fly it with paravol train."
        )
    return load_probe_path(file)


def start_path(patient: PatientScene, start: Start) -> ProbePath:
    """Return the way straight in from where a scope enters, and back."""
    fulcrum = nostril_fulcrum(patient, None, start)
    axis = fulcrum.axis / np.linalg.norm(fulcrum.axis)
    distance = patient.surface.distance
    free_mm = air_reach(distance, fulcrum.pivot_mm, axis, STRAIGHT_MM)
    return straight_path(Approach(fulcrum.pivot_mm, axis, free_mm), distance)
