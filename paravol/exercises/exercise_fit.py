"""Whether an exercise fits its head: what the check of a file and a flight both ask."""

from collections.abc import Iterator

from paravol.patient import PatientScene
from paravol.sessions.session_setup import coverage_watch, untouched
from scenarios import Scenario
from scenarios.exercise_check import HeadNames, head_problems, untouched_problems
from scenarios.tasks.checks import Problem, sentence
from scenarios.tasks.task import Survey
from system import UserError


def fit_problems(scenario: Scenario, patient: PatientScene) -> Iterator[Problem]:
    """Yield why the exercise cannot be done on its head, or need not be.

    patient: as before anybody operated.
    """
    found = list(head_problems(scenario, _names(scenario, patient)))
    yield from found
    if not found:
        head = untouched(patient)
        yield from untouched_problems(scenario.tasks, head, patient.landmarks)


def check_fit(scenario: Scenario, patient: PatientScene) -> None:
    """Raise UserError where the exercise cannot be done on its head."""
    for problem in fit_problems(scenario, patient):
        raise UserError(f"The exercise {scenario.name!r}: {sentence(problem)}")


def _names(scenario: Scenario, patient: PatientScene) -> HeadNames:
    """Return the names that the exercise may use of the head."""
    hazards, layers = patient.hazards, patient.layers
    sites = None
    if any(isinstance(task, Survey) for task in scenario.tasks):
        # takes a second the first time: only where sites are asked for
        sites = coverage_watch(patient).mucosa.members
    return HeadNames(
        patient.landmarks,
        None if hazards is None else hazards.volumes,
        None if layers is None else {kind.name for kind in layers.kinds if kind.name},
        sites,
    )
