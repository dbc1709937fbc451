"""A short recorded flight before the hoops, a scene that is built at once."""

from functools import cache
from pathlib import Path

import numpy as np

from paravol.patient import PatientScene, load_patient, no_progress
from scenarios import Sample, Scenario, load_scenario, tip_frame
from tests.recorded_flight import Flight


@cache
def scene() -> tuple[Scenario, PatientScene]:
    scenario, _ = load_scenario("hoops")
    return scenario, load_patient(scenario, no_progress)


def sample(number: int) -> Sample:
    """Go straight in, 4 mm/s."""
    at, axis = np.array([0.0, 0.2 * number, 0.0]), np.array([0.0, 1.0, 0.0])
    return Sample(0.05 * number, tip_frame(at, axis), 0.0, at, axis, 0)


def begun(created: str) -> Flight:
    """Return a flight that nobody asked to record, before its first sample."""
    return Flight(*scene(), operates=False, created=created, automatic=True)


def record(
    folder: Path, *, created: str = "2026-03-01T10:00:00+00:00", has_end: bool = True
) -> Path:
    """Record two seconds straight in; without an end, as if the program was killed."""
    flight = begun(created)
    with flight.recorded(folder, has_end):
        for number in range(40):
            flight.step(sample(number))
    return folder
