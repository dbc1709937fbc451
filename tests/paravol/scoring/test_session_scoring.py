"""Recordings that are trusted give what stepping gives; others are told, not scored."""

import csv
import shutil
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from io import StringIO
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.cli.score_command import as_csv
from paravol.progress.session_entry import entry_of_session
from paravol.scoring import session_scoring
from paravol.scoring.session_metrics import session_metrics
from paravol.scoring.session_scoring import (
    BatchOrder,
    Scored,
    rubric_for,
    score_all,
    score_session,
)
from scenarios import Scenario, load_scenario
from scenarios.bundle import (
    EditRecord,
    EventRecord,
    PatientRecord,
    Record,
    SampleRecord,
    read_recording,
    write_json,
)
from scenarios.instrument_state import EMPTY_HAND
from scenarios.metrics import DEFINITIONS, Metric
from scenarios.passing import goals_of
from scenarios.rubrics import Evidence, Rubric, Verdict, assess, load_rubric
from scenarios.scenario import CURRICULUM
from scenarios.scoring import OperationFigures
from scenarios.tasks import TaskState
from scenarios.tasks.engine import Status
from scenarios.tasks.task import Remove
from system import UserError
from tests.recorded_flight import Recorded, record, shaving, write_records

RUBRIC = load_rubric("operation")
EXERCISES = sorted(file.stem for file in CURRICULUM.glob("*.toml"))


@pytest.fixture
def heads(flight: Recorded, monkeypatch: pytest.MonkeyPatch) -> None:
    """Batches find the head of the flight loaded."""
    monkeypatch.setattr(session_scoring, "patient_of", lambda _: flight.patient)


def changed(
    flight: Recorded, folder: Path, change: Callable[[Record], Record | None]
) -> Path:
    """Copy a session; change returns a record, or None to leave it out."""
    recording = read_recording(flight.folder)
    kept = [new for r in recording.records if (new := change(r)) is not None]
    write_records(folder, recording.info, kept)
    shutil.copy(flight.folder / "result.json", folder / "result.json")
    return folder


def test_trusting_a_recording_gives_what_stepping_it_gives(flight: Recorded) -> None:
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


def unread(record: Record) -> Record:
    if isinstance(record, SampleRecord):
        return msgspec.structs.replace(record, reading=None)
    return record


def test_a_flight_that_stood_throughout_is_one_that_nobody_changed(
    flight: Recorded, tmp_path: Path
) -> None:
    """One that ends before the overview is drawn, say."""
    folder = tmp_path / "stood.paravol"
    centre = flight.patient.scene.volume.center_mm
    samples = (shaving(number, centre, is_frozen=True) for number in range(9))
    record(folder, load_scenario("first_flight")[0], flight.patient, samples)
    trusted = session_metrics(folder, patient=flight.patient)
    assert (
        trusted.score
        == session_metrics(folder, patient=flight.patient, exact=True).score
    )


def test_all_ways_score_alike(flight: Recorded, tmp_path: Path) -> None:
    """Also a recording of before, which did not keep what was measured."""
    trusted, _ = score_session(flight.folder, RUBRIC, patient=flight.patient)
    exact, found = score_session(
        flight.folder, RUBRIC, patient=flight.patient, exact=True
    )
    assert found.source == "stepped: asked for"
    place = changed(flight, tmp_path / "old.paravol", unread)
    old, found = score_session(place, RUBRIC, patient=flight.patient)
    assert found.source.startswith("stepped: it is of a version")
    assert (old.percent, old.fails) == (exact.percent, exact.fails)
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
    "change", [moved, cut_less, without_injuries, other_patient, backwards]
)
@pytest.mark.usefixtures("heads")
def test_an_edited_stream_is_told(
    flight: Recorded, tmp_path: Path, change: Callable[[Record], Record | None]
) -> None:
    changed(flight, tmp_path / "in" / "a.paravol", change)
    (line,) = score_all(tmp_path / "in", BatchOrder(RUBRIC, tmp_path / "out"), None)
    assert line.assessment is None
    assert line.problem.startswith("changed: The stream")


@pytest.mark.usefixtures("heads")
def test_a_mark_that_was_edited_is_told_and_not_believed(
    flight: Recorded, tmp_path: Path
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
def folder(flight: Recorded, tmp_path: Path) -> Path:
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
    newer = msgspec.structs.replace(RUBRIC, version=RUBRIC.version + 1)
    list(score_all(folder, BatchOrder(newer, order.out), None))
    assert len(scored) == 7


@pytest.mark.usefixtures("heads")
def test_workers_find_the_same(folder: Path) -> None:
    alone = by_name(list(score_all(folder, BatchOrder(RUBRIC, folder / "a"), None)))
    with ThreadPoolExecutor(2) as executor:
        order = BatchOrder(RUBRIC, folder / "b")
        together = by_name(list(score_all(folder, order, executor)))
    assert together == alone


@pytest.mark.usefixtures("heads")
def test_each_session_is_scored_for_what_was_done(
    flight: Recorded, tmp_path: Path
) -> None:
    """By the rubric of who cut or who only looked; a table has the items of both."""
    folder = tmp_path / "sessions"
    shutil.copytree(flight.folder, folder / "cut.paravol")
    scenario, _ = load_scenario("first_flight")
    centre = flight.patient.scene.volume.center_mm
    looked = (replace(shaving(n, centre), instrument=EMPTY_HAND) for n in range(80))
    place = folder / "looked.paravol"
    record(place, scenario, flight.patient, looked, operates=False)
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
