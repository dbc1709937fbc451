"""An exercise made of a recording loads, and the recording passes it."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from devices import load_probe_path
from paravol.exercises.recorded_scenario import scenario_from_session
from paravol.patient import PatientScene
from paravol.sessions.session_setup import build_session
from renderers.scene import AirSurface, Volume
from scenarios import InstrumentState, Sample, load_scenario, tip_frame
from scenarios.bundle import SampleRecord, read_recording
from scenarios.instrument_state import NO_TOOL
from scenarios.tasks.engine import Status
from scenarios.tasks.task import Follow, Reach
from system import UserError
from tests.recorded_flight import info_of, write_records
from tests.scenes import make_scene

EVERY_S = 0.04
SHIFT = np.array([30.0, -20.0, 10.0])
"""Where the arm's own frame lies."""


def samples() -> list[Sample]:
    """Fly an arc of 40 mm, frozen for a while, pausing for 2.4 s, shaking."""
    random = np.random.default_rng(1)
    angle = np.concatenate([np.linspace(0, 1, 120), np.full(60, 1.0)])
    angle = np.concatenate([angle, np.linspace(1, 2, 120)])
    found = []
    for number, a in enumerate(angle):
        tip = 20.0 * np.array([np.cos(a), np.sin(a), 0.1 * a])
        tip = tip + random.normal(scale=0.05, size=3)
        axis = np.array([-np.sin(a), np.cos(a), 0.1])
        axis /= np.linalg.norm(axis)
        frame = tip_frame(tip, axis)
        frame[:3, 3] -= SHIFT
        tool = "curette" if number > 40 else "microdebrider"
        tool = NO_TOOL if number < 20 else tool
        found.append(
            Sample(
                1.0 + EVERY_S * number,
                frame,
                (170.0 + number) % 360.0,
                tip,
                axis if number >= 20 else np.zeros(3),
                3,
                InstrumentState(tool),
                is_frozen=60 <= number < 90,
            )
        )
    return found


Flown = tuple[Path, PatientScene]


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    folder = tmp_path_factory.mktemp("recorded") / "An expert's way.paravol"
    values = np.full((30, 60, 60), -4.0, np.float32)
    distance = Volume(values, np.ones(3), np.array([-30.0, -30, -15]), np.eye(3), 1.0)
    zeros = distance.with_values(np.zeros(values.shape, np.uint8), 0)
    air = AirSurface(distance, zeros, zeros)
    scene = replace(make_scene(), surface=air)
    scenario, _ = load_scenario("first_flight")
    landmarks = dict.fromkeys(scenario.targets, np.zeros(3))
    patient = PatientScene(scene, landmarks, "a" * 64)
    info = info_of(scenario, patient)
    matrix = np.eye(4)
    matrix[:3, 3] = SHIFT
    info = msgspec.structs.replace(info, world_from_device=matrix.ravel().tolist())
    return write_records(folder, info, map(SampleRecord.of, samples())), patient


def test_the_recording_passes_the_exercise_made_of_it(
    flown: Flown, tmp_path: Path
) -> None:
    """Read from the written file, stepped by the recorded samples, frozen ones too."""
    folder, patient = flown
    made = scenario_from_session(folder, tmp_path, patient=patient)
    assert made.file.name == "an_expert_s_way.toml"
    scenario, place = load_scenario(str(made.file))
    recorded, _ = load_scenario("first_flight")
    assert (scenario.head, scenario.scope) == (recorded.head, recorded.scope)
    assert (scenario.fiducials, scenario.targets) == (
        recorded.fiducials,
        recorded.targets,
    )
    stops = [task for task in scenario.tasks if isinstance(task, Reach)]
    rings = [r for t in scenario.tasks if isinstance(t, Follow) for r in t.rings]
    assert (made.stops, made.hoops) == (len(stops), len(rings))
    assert len(stops) == 1
    assert len(rings) >= 3
    np.testing.assert_allclose(
        np.array(stops[0].place, dtype=np.float64),
        20.0 * np.array([np.cos(1), np.sin(1), 0.1]),
        atol=1.0,
    )
    # air of 4 mm all around
    assert {ring.radius_mm for ring in rings} == {4.0}
    matrix = np.array(read_recording(folder).info.world_from_device).reshape(4, 4)
    session = build_session(scenario, patient, matrix, (32, 32))
    for sample in samples():
        session.step(sample)
    assert session.tasks is not None
    assert {s.name: s.status for s in session.tasks.ended()} == {
        task.name: Status.DONE for task in scenario.tasks
    }
    path = load_probe_path(place / scenario.path)
    flown_samples = [s for s in samples() if not s.is_frozen]
    assert path.duration_s == pytest.approx(made.duration_s)
    # frozen time is gone: from the last before it to the first after it
    assert path.duration_s == pytest.approx(EVERY_S * (299 - 31), abs=EVERY_S + 1e-6)
    tips = np.array([s.device_from_tip[:3, 3] + SHIFT for s in flown_samples])
    np.testing.assert_allclose(path.tip_mm[-100:], tips[-100:])
    assert [name for _, name in path.tools] == ["microdebrider", "curette"]


def test_the_path_file_passes_it_as_well(flown: Flown, tmp_path: Path) -> None:
    folder, patient = flown
    made = scenario_from_session(folder, tmp_path, name="again", patient=patient)
    scenario, place = load_scenario(str(made.file))
    path = load_probe_path(place / scenario.path)
    session = build_session(scenario, patient, np.eye(4), (32, 32))
    for time_s in np.arange(0.0, path.duration_s, 0.01):
        at = path.sample(float(time_s))
        frame = tip_frame(at.tip_mm, at.axis)
        tool = at.instrument_tip_mm, at.instrument_axis
        session.step(Sample(float(time_s), frame, at.roll_deg, *tool, at.buttons))
    assert session.tasks is not None
    assert session.tasks.is_complete


def test_files_that_are_there_stay_and_other_heads_are_refused(
    flown: Flown, tmp_path: Path
) -> None:
    folder, patient = flown
    (tmp_path / "mine.path.json").write_text("mine")
    with pytest.raises(UserError, match="is there already"):
        scenario_from_session(folder, tmp_path, name="mine", patient=patient)
    with pytest.raises(UserError, match="one word"):
        scenario_from_session(folder, tmp_path, name="../x", patient=patient)
    other = PatientScene(patient.scene, patient.landmarks, "b" * 64)
    with pytest.raises(UserError, match="another head"):
        scenario_from_session(folder, tmp_path, patient=other)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.path.json"]
