"""Recordings that are trusted give what stepping gives; others are told, not scored."""

import csv
import re
import shutil
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from io import StringIO
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from app.cli.score_command import as_csv
from disk import UserError
from paravol import session_scoring
from paravol.inputs.flight_input import in_the_patient
from paravol.patient import PatientScene
from paravol.progress.session_entry import entry_of_session
from paravol.session_metrics import session_metrics
from paravol.session_scoring import (
    BatchOrder,
    Scored,
    rubric_for,
    score_all,
    score_session,
)
from paravol.session_setup import build_session, describe_session, operate_on
from scenarios import Sample, Scenario, load_scenario, tip_frame
from scenarios.bundle import (
    EditRecord,
    EventRecord,
    FrameRecord,
    PatientRecord,
    Record,
    SampleRecord,
    SessionRecorder,
    read_recording,
    write_json,
)
from scenarios.instrument_state import EMPTY_HAND, InstrumentState
from scenarios.metrics import DEFINITIONS, Metric
from scenarios.passing import goals_of
from scenarios.rubrics import Evidence, Rubric, Verdict, assess, load_rubric
from scenarios.scenario import CURRICULUM
from scenarios.scoring import OperationFigures
from scenarios.tasks import TaskState
from scenarios.tasks.engine import Status
from scenarios.tasks.task import Remove
from tests.paravol.operated_head import head_round_an_orbit

RUBRIC = load_rubric("operation")
EXERCISES = sorted(file.stem for file in CURRICULUM.glob("*.toml"))


@dataclass(frozen=True)
class Flight:
    folder: Path
    patient: PatientScene


def sample_at(number: int, centre: NDArray[np.float64]) -> Sample:
    """Shave to and fro, take strokes back, and stand still for a while."""
    way = np.array([1.0, 0.2, 0.1])
    at = centre + way * 3.0 * np.sin(number / 11.0) + [0.0, 0.02 * number - 1.5, 0.0]
    state = InstrumentState(
        "microdebrider",
        is_working=number % 13 < 9,
        is_sucking=number % 31 < 25,
        undone=number // 30,
    )
    frame, is_frozen = tip_frame(at - 3 * way, way), 44 <= number < 50
    return Sample(0.05 * number, frame, 0.0, at, way, 0, state, is_frozen)


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
        for number in range(80):
            sample = sample_at(number, centre)
            session.step(sample)
            recorder.add(SampleRecord.of(sample, session.reading))
            assert session.placed is not None
            gap_mm = session.placed.gap_mm
            recorder.add(FrameRecord(number, number, 1.0, gap_mm))
            for edit in operation.take_edits():
                recorder.add(EditRecord.of(edit))
            for injury in operation.take_injuries():
                recorder.add(EventRecord(injury.time_s, "injury", injury.structure))
        kept = operation.patient
        recorder.add(PatientRecord(sample.time_s, kept.generation, kept.hash()))
        recorder.close({"score": asdict(session.score())})
    return Flight(folder, patient)


@pytest.fixture
def heads(flight: Flight, monkeypatch: pytest.MonkeyPatch) -> None:
    """Batches find the head of the flight loaded."""
    monkeypatch.setattr(session_scoring, "patient_of", lambda _: flight.patient)


def changed(flight: Flight, folder: Path, change: Callable[[Record], object]) -> Path:
    """Copy a session; change returns a record, or None to leave it out."""
    recording = read_recording(flight.folder)
    with SessionRecorder(folder, recording.info) as recorder:
        for record in recording.records:
            new = change(record)
            if new is not None:
                recorder.add(new)  # type: ignore[arg-type]
        recorder.close()
    shutil.copy(flight.folder / "result.json", folder / "result.json")
    return folder


def test_trusting_a_recording_gives_what_stepping_it_gives(flight: Flight) -> None:
    # an expert of oneself: its cavity is made again by its cuts alone
    compared = partial(
        session_metrics, flight.folder, patient=flight.patient, expert=flight.folder
    )
    stepped, trusted = compared(exact=True), compared()
    assert trusted.source == "recorded"
    assert trusted.score == stepped.score
    assert any(m.name == "breaches: orbit" and m.value for m in trusted.metrics)
    found = {m.name: m.value for m in trusted.metrics}
    assert found["cavity distance to expert"] == 0.0
    assert found["cavity overlap with expert"] == 1.0
    for one, other in zip(trusted.metrics, stepped.metrics, strict=True):
        assert (one.name, one.role) == (other.name, other.role)
        assert one.reason == other.reason
        assert (one.value, one.sigma) == (other.value, other.sigma)
        assert one.intervals == other.intervals


def test_both_ways_score_alike(flight: Flight) -> None:
    trusted, _ = score_session(flight.folder, RUBRIC, patient=flight.patient)
    exact, found = score_session(
        flight.folder, RUBRIC, patient=flight.patient, exact=True
    )
    assert found.source == "stepped: asked for"
    assert trusted.percent == exact.percent
    assert trusted.fails == exact.fails
    assert [fail.name for fail in exact.fails] == ["injury"]
    assert exact.fails[0].intervals
    assert exact.verdict is Verdict.NOT_PASSED


def moved(record: Record) -> Record:
    if isinstance(record, SampleRecord) and record.time_s == 1.0:
        frame = list(record.device_from_tip)
        frame[3] = (frame[3] or 0.0) + 0.5
        return msgspec.structs.replace(record, device_from_tip=frame)
    return record


def cut_less(record: Record) -> Record:
    if isinstance(record, EditRecord):
        return msgspec.structs.replace(record, counts=record.counts - 1)
    return record


def without_injuries(record: Record) -> Record | None:
    is_injury = isinstance(record, EventRecord) and record.kind == "injury"
    return None if is_injury else record


def other_patient(record: Record) -> Record:
    if isinstance(record, PatientRecord):
        return msgspec.structs.replace(record, xxh3_128="0" * 32)
    return record


def backwards(record: Record) -> Record:
    if isinstance(record, SampleRecord) and record.time_s == 2.0:
        return msgspec.structs.replace(record, time_s=0.1)
    return record


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (moved, "changed: The stream"),
        (cut_less, "changed: The stream"),
        (without_injuries, "changed: The stream"),
        (other_patient, "changed: The stream"),
        (backwards, "changed: The stream"),
    ],
)
@pytest.mark.usefixtures("heads")
def test_an_edited_stream_is_told(
    flight: Flight, tmp_path: Path, change: Callable[[Record], object], words: str
) -> None:
    changed(flight, tmp_path / "in" / "a.paravol", change)
    (line,) = score_all(tmp_path / "in", BatchOrder(RUBRIC, tmp_path / "out"), None)
    assert line.assessment is None

    assert re.search(words, line.problem), line.problem


@pytest.mark.usefixtures("heads")
def test_a_mark_that_was_edited_is_told_and_not_believed(
    flight: Flight, tmp_path: Path
) -> None:
    """By one more limit a pass would become none, or none a pass."""
    place = tmp_path / "in" / "a.paravol"
    shutil.copytree(flight.folder, place)
    info = read_recording(place).info
    scenario = msgspec.json.decode(info.scenario)
    scenario["pass"] = {"metrics": [{"name": "path length", "most": 1.0}]}
    text = msgspec.json.encode(scenario).decode()
    write_json(place / "session.json", msgspec.structs.replace(info, scenario=text))
    (line,) = score_all(tmp_path / "in", BatchOrder(None, tmp_path / "out"), None)
    assert line.assessment is None
    assert line.problem.startswith("changed: ")
    with pytest.raises(UserError, match=r"session\.json"):
        score_session(place, RUBRIC)
    # no progress is made by it, and what was flown can still be looked at
    with pytest.raises(UserError, match=r"session\.json"):
        entry_of_session(place)
    assert read_recording(place).is_edited


@pytest.fixture
def folder(flight: Flight, tmp_path: Path) -> Path:
    """A folder of good and bad sessions."""
    place = tmp_path / "sessions"
    for name in ("good", "group/also_good", "cut_off", "old", "no_stream", "empty"):
        shutil.copytree(flight.folder, place / f"{name}.paravol")
    stream = place / "cut_off.paravol" / "stream.mcap"
    stream.write_bytes(stream.read_bytes()[:-4000])
    old = place / "old.paravol" / "session.json"
    old.write_text(
        old.read_text().replace('"schema_version": 1', '"schema_version": 9')
    )
    (place / "no_stream.paravol" / "stream.mcap").unlink()
    shutil.rmtree(place / "empty.paravol")
    (place / "empty.paravol").mkdir()
    recording = read_recording(flight.folder)
    scenario = msgspec.json.decode(recording.info.scenario)
    scenario["head"]["case"] = "/nowhere/case"
    lost = msgspec.structs.replace(
        recording.info, scenario=msgspec.json.encode(scenario).decode()
    )
    shutil.copytree(flight.folder, place / "lost_case.paravol")
    write_json(place / "lost_case.paravol" / "session.json", lost)
    return place


def by_name(lines: list[Scored]) -> dict[str, Scored]:
    return {Path(line.session).stem: line for line in lines}


@pytest.mark.usefixtures("heads")
def test_a_batch_tells_each_bad_session_and_scores_the_others(folder: Path) -> None:
    order = BatchOrder(RUBRIC, folder / "out")
    lines = by_name(list(score_all(folder, order, None)))
    assert len(lines) == 7
    assert lines["good"].assessment is not None
    assert lines["also_good"].session == "group/also_good.paravol"
    assert lines["also_good"].assessment is not None
    cut_off = lines["cut_off"].assessment
    assert cut_off is not None
    assert not cut_off.is_complete
    assert lines["cut_off"].source == "stepped: the stream is damaged or has no end"
    assert "schema_version" in lines["old"].problem
    assert "stream.mcap cannot be read" in lines["no_stream"].problem
    assert "is not a session" in lines["empty"].problem
    assert "/nowhere/case" in lines["lost_case"].problem


@pytest.mark.usefixtures("heads")
def test_what_is_done_is_not_done_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order = BatchOrder(RUBRIC, folder / "out")
    first = by_name(list(score_all(folder, order, None)))
    scored: list[str] = []
    real = session_scoring.score_line

    def counted(path: Path, name: str, order: BatchOrder) -> Scored:
        scored.append(path.stem)
        return real(path, name, order)

    monkeypatch.setattr(session_scoring, "score_line", counted)
    assert by_name(list(score_all(folder, order, None))) == first
    assert scored == []
    # a byte of a bundle, a kept line that was cut off, another version of the rubric
    result = folder / "good.paravol" / "result.json"
    result.write_text(result.read_text() + " ")
    kept = next((folder / "out").glob("group__also_good*"))
    kept.write_bytes(kept.read_bytes()[:-20])
    assert by_name(list(score_all(folder, order, None))).keys() == first.keys()
    assert sorted(scored) == ["also_good", "good"]
    scored.clear()
    newer = replace_version(order)
    list(score_all(folder, newer, None))
    assert len(scored) == 7


def replace_version(order: BatchOrder) -> BatchOrder:
    rubric = msgspec.structs.replace(RUBRIC, version=RUBRIC.version + 1)
    return msgspec.structs.replace(order, rubric=rubric)


@pytest.mark.usefixtures("heads")
def test_workers_find_the_same(folder: Path) -> None:
    alone = by_name(list(score_all(folder, BatchOrder(RUBRIC, folder / "a"), None)))
    with ThreadPoolExecutor(2) as executor:
        order = BatchOrder(RUBRIC, folder / "b")
        together = by_name(list(score_all(folder, order, executor)))
    assert together == alone


@pytest.mark.usefixtures("heads")
def test_each_session_is_scored_for_what_was_done(
    flight: Flight, tmp_path: Path
) -> None:
    """By the rubric of who cut or who only looked; a table has the items of both."""
    folder = tmp_path / "sessions"
    shutil.copytree(flight.folder, folder / "cut.paravol")
    scenario, _ = load_scenario("first_flight")
    info = describe_session(
        scenario, flight.patient, in_the_patient(), size=32, has_instrument=False
    )
    session = build_session(scenario, flight.patient, np.eye(4), (32, 32), None)
    with SessionRecorder(folder / "looked.paravol", info) as recorder:
        for number in range(80):
            sample = sample_at(number, flight.patient.scene.volume.center_mm)
            sample = replace(sample, instrument=EMPTY_HAND)
            session.step(sample)
            recorder.add(SampleRecord.of(sample))
        recorder.close({"score": asdict(session.score())})
    found = list(score_all(folder, BatchOrder(None, tmp_path / "out"), None))
    used = {line.session: line.assessment.rubric for line in found if line.assessment}
    assert used == {"cut.paravol": "operation", "looked.paravol": "endoscopy"}
    again = list(score_all(folder, BatchOrder(None, tmp_path / "out"), None))
    assert by_name(again) == by_name(found)
    rows = {
        row["Session"]: row for row in csv.DictReader(StringIO(as_csv(found, None)))
    }
    for line in found:
        assert line.assessment is not None
        found_by = f"{line.assessment.rubric} {line.assessment.rubric_version}"
        for part in line.assessment.parts:
            told = rows[line.session][f"{found_by}: {part.name}"]
            assert told == (repr(part.points) if part.counts else "")
    # items of another rubric are none of its own
    others = [n for n in rows["looked.paravol"] if n.endswith(": blood")]
    assert others
    assert {rows["looked.paravol"][name] for name in others} == {""}


@pytest.mark.usefixtures("heads")
def test_a_stop_leaves_whole_lines_to_go_on_from(folder: Path) -> None:
    order = BatchOrder(RUBRIC, folder / "out")
    lines = score_all(folder, order, None)
    assert isinstance(lines, Generator)
    first = [next(lines), next(lines)]
    lines.close()  # as Ctrl-C leaves it
    files = sorted((folder / "out").iterdir())
    assert len(files) == 2
    kept = [msgspec.json.decode(file.read_bytes(), type=Scored) for file in files]
    assert {line.session for line in kept} == {line.session for line in first}


def best(rubric: Rubric) -> list[Metric]:
    """Return every metric at the value that the rubric gives most for."""
    wished = {
        (item.metric, item.role): max(item.bands, key=lambda knot: knot[1])[0]
        for item in rubric.items
    }
    return [
        Metric(d.name, d.role, d.unit, wished.get((d.name, d.role), 0.0))
        for d in DEFINITIONS
    ]


def untouched(scenario: Scenario) -> list[TaskState]:
    """Return how tasks end where nobody does anything: what is kept is done."""
    goals = goals_of(scenario)
    return [
        TaskState(task.name, Status.OPEN if task.name in goals else Status.DONE)
        for task in scenario.tasks
    ]


@pytest.mark.parametrize("has_cuts", [False, True])
@pytest.mark.parametrize("name", EXERCISES)
@given(way_mm=st.floats(0.0, 1000.0), seconds=st.floats(0.0, 29.0))
@settings(max_examples=20)
def test_nothing_done_gives_no_points(
    name: str, has_cuts: bool, way_mm: float, seconds: float
) -> None:
    scenario, _ = load_scenario(name)
    rubric = rubric_for(scenario, has_cuts=has_cuts)
    flown = {"path length": way_mm, "task time": seconds}
    metrics = [replace(m, value=flown.get(m.name, m.value)) for m in best(rubric)]
    evidence = Evidence(
        "a.paravol",
        name,
        metrics,
        (0.0, seconds),
        untouched(scenario),
        operation=OperationFigures(),
        exercise=scenario,
    )
    found = assess(rubric, evidence)
    assert found.percent == (None if way_mm < rubric.least_path_mm else 0.0)
    assert found.verdict is Verdict.NOT_PASSED
    for part in found.parts:
        if part.source == "task time":
            assert part.points == 0.0


@pytest.mark.parametrize("name", EXERCISES)
def test_an_operation_is_judged_as_one_whether_anything_was_cut_or_not(
    name: str,
) -> None:
    """An uncinectomy without a cut was judged as an endoscopy."""
    scenario, _ = load_scenario(name)
    rubric = rubric_for(scenario, has_cuts=False)
    is_operation = bool(scenario.tools)
    assert rubric.name == ("operation" if is_operation else "endoscopy")
    assert rubric_for(scenario, has_cuts=True).name == "operation"
    # what is wanted taken is what the exercise wants, no other one's tissue
    wanted = set(rubric.settings.wanted_mm3)
    asked = {
        tissue
        for task in scenario.tasks
        if isinstance(task, Remove)
        for tissue, limits in task.tissues.items()
        if limits.least_mm3 > 0.0
    }
    assert wanted == asked
