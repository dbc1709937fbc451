"""Metrics of a recording agree with what the session itself counted."""

from pathlib import Path

import numpy as np
import pytest

from paravol.scoring.session_metrics import session_metrics
from paravol.slices.coverage_map import session_coverage
from scenarios.bundle import read_recording
from scenarios.metrics import Metric, Settings, definitions_named
from system import UserError
from tests.recorded_flight import Recorded, write_records


@pytest.fixture(scope="module")
def found(flight: Recorded) -> dict[tuple[str, str], Metric]:
    metrics = session_metrics(flight.folder, patient=flight.patient).metrics
    return {(metric.role, metric.name): metric for metric in metrics}


def test_removal_is_what_the_books_say(
    flight: Recorded, found: dict[tuple[str, str], Metric]
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


def test_a_cavity_is_compared_as_it_was_after_all_undoing(flight: Recorded) -> None:
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
    flight: Recorded, found: dict[tuple[str, str], Metric]
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
    flight: Recorded, found: dict[tuple[str, str], Metric]
) -> None:
    assert found["scope", "task time"].value == pytest.approx(flight.score.duration_s)
    for name, distance_mm in flight.score.target_distance_mm.items():
        assert found["scope", f"nearest to: {name}"].value == pytest.approx(distance_mm)


def test_without_the_head_only_motion_is_known(flight: Recorded) -> None:
    metrics = session_metrics(flight.folder, has_head=False).metrics
    by_name = {(m.role, m.name): m for m in metrics}
    assert by_name["scope", "path length"].value is not None
    assert by_name["scope", "contacts"].value is None
    assert by_name["patient", "tissue removed: in all"].value is None


def test_chosen_metrics_and_settings(flight: Recorded) -> None:
    chosen = definitions_named(("idle share",))
    all_idle = Settings(idle_mm_s=1e4)
    result = session_metrics(
        flight.folder, has_head=False, chosen=chosen, settings=all_idle
    )
    assert [m.name for m in result.metrics] == ["idle share"] * 2
    assert result.metrics[0].value == pytest.approx(1.0)


def test_an_arm_that_cannot_be_there_is_refused(flight: Recorded) -> None:
    with pytest.raises(UserError, match="profile must be one of"):
        session_metrics(flight.folder, has_head=False, arm="nobody's")


def test_a_recording_without_samples_is_refused(
    tmp_path: Path, flight: Recorded
) -> None:
    info = read_recording(flight.folder).info
    empty = write_records(tmp_path / "empty.paravol", info, [])
    with pytest.raises(UserError, match="holds no sample"):
        session_metrics(empty, patient=flight.patient)


def test_what_was_seen_is_what_the_session_watched(
    flight: Recorded, found: dict[tuple[str, str], Metric]
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
