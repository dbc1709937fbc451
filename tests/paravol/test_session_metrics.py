"""Metrics of a recording agree with what the session itself counted."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from disk import UserError
from paravol.coverage_map import session_coverage
from paravol.inputs.flight_input import in_the_patient
from paravol.patient import PatientScene
from paravol.session_metrics import session_metrics
from paravol.session_setup import build_session, describe_session, operate_on
from scenarios import Sample, Score, load_scenario, tip_frame
from scenarios.bundle import SampleRecord, SessionRecorder
from scenarios.instrument_state import InstrumentState
from scenarios.metrics import Metric, Settings, definitions_named
from tests.paravol.operated_head import head_round_an_orbit

EVERY_S, COUNT = 0.05, 120


@dataclass(frozen=True)
class Flight:
    """A recorded operation, and what the session told of it."""

    folder: Path
    patient: PatientScene
    score: Score


def sample_at(number: int, centre: NDArray[np.float64]) -> Sample:
    """Shave to and fro, and take strokes back twice."""
    way = np.array([1.0, 0.2, 0.1])
    along = 3.0 * np.sin(number / 11.0)
    at = centre + way * along + [0.0, 0.02 * number - 1.5, 0.0]
    state = InstrumentState(
        "microdebrider",
        is_working=number % 13 < 9,
        is_sucking=number % 31 < 25,
        undone=number // 50,
    )
    frame = tip_frame(at - 3 * way, way)
    return Sample(EVERY_S * number, frame, 0.0, at, way, 0, state)


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    folder = tmp_path_factory.mktemp("recorded") / "flight.paravol"
    scenario, _ = load_scenario("first_flight")
    patient = head_round_an_orbit(scenario)
    centre = patient.scene.volume.center_mm
    info = describe_session(
        scenario, patient, in_the_patient(), size=32, has_instrument=True
    )
    operated, operation = operate_on(patient)
    session = build_session(scenario, operated, np.eye(4), (32, 32), operation)
    with SessionRecorder(folder, info) as recorder:
        for number in range(COUNT):
            sample = sample_at(number, centre)
            session.step(sample)
            recorder.add(SampleRecord.of(sample))
        recorder.close({"score": asdict(session.score())})
    return Flight(folder, patient, session.score())


@pytest.fixture(scope="module")
def found(flight: Flight) -> dict[tuple[str, str], Metric]:
    metrics = session_metrics(flight.folder, patient=flight.patient).metrics
    return {(metric.role, metric.name): metric for metric in metrics}


def test_removal_is_what_the_books_say(
    flight: Flight, found: dict[tuple[str, str], Metric]
) -> None:
    """Without the strokes that were taken back."""
    figures = flight.score.operation
    assert figures is not None
    assert figures.edits
    removed = found["patient", "tissue removed: in all"]
    assert removed.value == pytest.approx(sum(figures.removed_mm3.values()))
    # edits counts cuts ever made
    assert 0 < len(removed.intervals) < figures.edits
    for tissue, mm3 in figures.removed_mm3.items():
        if mm3:
            told = found["patient", f"tissue removed: {tissue}"].value
            assert told == pytest.approx(mm3)


def test_a_cavity_is_compared_as_it_was_after_all_undoing(flight: Flight) -> None:
    """Strokes were taken back: the expert's session must be stepped to know it."""
    chosen = definitions_named(
        ("cavity distance to expert", "cavity overlap with expert", "tissue removed")
    )
    found = session_metrics(
        flight.folder, patient=flight.patient, expert=flight.folder, chosen=chosen
    )
    values = {metric.name: metric.value for metric in found.metrics}
    assert values["cavity distance to expert"] == 0.0
    assert values["cavity overlap with expert"] == 1.0
    cavity = found.measured.cavity
    assert cavity is not None
    # voxels whose middle became air, against the books' partial ones
    voxel_mm3 = float(np.prod(flight.patient.surface.distance.spacing_mm))
    mm3 = len(cavity.voxels) * voxel_mm3
    assert mm3 == pytest.approx(values["tissue removed: in all"], rel=0.3)


def test_contacts_and_hazards_are_the_scores(
    flight: Flight, found: dict[tuple[str, str], Metric]
) -> None:
    score, figures = flight.score, flight.score.operation
    assert score.worst_depth_mm > 0
    assert found["scope", "deepest contact"].value == score.worst_depth_mm
    assert score.hazards is not None
    orbit = score.hazards["orbit"]
    nearest = found["scope", "smallest distance: orbit"]
    assert nearest.value == orbit.shaft_mm
    assert nearest.intervals == ((orbit.shaft_s, orbit.shaft_s),)
    assert found["tool", "smallest distance: orbit"].value == orbit.instrument_mm
    assert figures is not None
    assert figures.injuries
    assert found["patient", "breaches: orbit"].value == len(figures.injuries)


def test_time_and_targets_are_the_scores(
    flight: Flight, found: dict[tuple[str, str], Metric]
) -> None:
    assert found["scope", "task time"].value == pytest.approx(flight.score.duration_s)
    for name, distance_mm in flight.score.target_distance_mm.items():
        assert found["scope", f"nearest to: {name}"].value == pytest.approx(distance_mm)


def test_without_the_head_only_motion_is_known(flight: Flight) -> None:
    metrics = session_metrics(flight.folder, has_head=False).metrics
    by_name = {(m.role, m.name): m for m in metrics}
    assert by_name["scope", "path length"].value is not None
    assert by_name["scope", "contacts"].value is None
    assert by_name["patient", "tissue removed: in all"].value is None


def test_chosen_metrics_and_settings(flight: Flight) -> None:
    chosen = definitions_named(("idle share",))
    all_idle = Settings(idle_mm_s=1e4)
    result = session_metrics(
        flight.folder, has_head=False, chosen=chosen, settings=all_idle
    )
    assert [m.name for m in result.metrics] == ["idle share"] * 2
    assert result.metrics[0].value == pytest.approx(1.0)


def test_an_arm_that_cannot_be_there_is_refused(flight: Flight) -> None:
    with pytest.raises(UserError, match="profile must be one of"):
        session_metrics(flight.folder, has_head=False, arm="nobody's")


def test_a_recording_without_samples_is_refused(tmp_path: Path, flight: Flight) -> None:
    empty = tmp_path / "empty.paravol"
    scenario, _ = load_scenario("first_flight")
    info = describe_session(
        scenario, flight.patient, in_the_patient(), size=32, has_instrument=True
    )
    with SessionRecorder(empty, info) as recorder:
        recorder.close({})
    with pytest.raises(UserError, match="holds no sample"):
        session_metrics(empty, patient=flight.patient)


def test_what_was_seen_is_what_the_session_watched(
    flight: Flight, found: dict[tuple[str, str], Metric]
) -> None:
    coverage = flight.score.coverage
    assert coverage is not None
    assert coverage.sites
    for name, site in coverage.sites.items():
        told = found["scope", f"surface seen: {name}"]
        assert told.value == site.seen_percent
        assert told.sigma == site.uncertain_percent
    again = session_coverage(flight.folder, patient=flight.patient)
    assert again.watch.figures() == coverage
