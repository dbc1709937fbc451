"""A flight that is over is scored and kept, whatever is wrong with it."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from paravol.progress.keep_flight import keep_flight
from paravol.progress.store import ProgressStore
from scenarios import Sample, load_scenario, tip_frame
from scenarios.instrument_state import EMPTY_HAND
from scenarios.scenario import MetricLimit, PassMarks
from tests.paravol.operated_head import head_round_an_orbit
from tests.recorded_flight import Recorded, record


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """Fly straight, of an exercise that asks for a short path."""
    folder = tmp_path_factory.mktemp("kept") / "flight.paravol"
    scenario, _ = load_scenario("first_flight")
    marks = PassMarks(metrics=(MetricLimit("path length, raw", "scope", most=1.0),))
    scenario = msgspec.structs.replace(scenario, marks=marks, tasks=())
    patient = head_round_an_orbit(scenario)
    way, nowhere = np.array([1.0, 0.2, 0.1]), np.zeros(3)
    samples = []
    for n in range(40):
        frame = tip_frame(patient.scene.volume.center_mm + 0.1 * n * way, way)
        samples.append(Sample(0.05 * n, frame, 0.0, nowhere, way, 0, EMPTY_HAND))
    return record(folder, scenario, patient, samples, operates=False)


def test_it_is_scored_and_judged_by_its_own_exercise(
    flight: Recorded, tmp_path: Path
) -> None:
    folder, patient = flight.folder, flight.patient
    store = tmp_path / "progress.sqlite"
    kept = keep_flight(folder, "Enzian", store, patient=patient)
    assert kept.assessment is not None
    assert kept.assessment.rubric == "endoscopy"
    (entry,) = ProgressStore(store).sessions()
    assert entry == kept.entry
    assert entry.scored is not None
    assert entry.scored.percent == kept.assessment.percent
    assert entry.has_passed is False
    assert any("path length, raw: " in line for line in kept.said)


def test_without_its_head_it_is_kept_by_its_motion(
    flight: Recorded, tmp_path: Path
) -> None:
    folder, patient = flight.folder, flight.patient
    stranger = replace(patient, surface_sha256="b" * 64)
    kept = keep_flight(folder, "", tmp_path / "p.sqlite", patient=stranger)
    assert kept.assessment is None
    assert kept.entry is not None
    assert kept.entry.scored is None
    assert kept.entry.value("path length") is not None
    assert kept.said[0].startswith("Not scored: ")
