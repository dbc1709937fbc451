"""A recording as input: every sample comes back, bit by bit."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from devices import ProbePath, save_probe_path
from devices.controls.fulcrum import Demand, Fulcrum, FulcrumControl
from paravol.inputs.recording import RecordingInput
from paravol.patient import PatientScene
from scenarios import Sample, Scenario
from scenarios.bundle import SampleRecord
from tests.flights import part_of
from tests.recorded_flight import write_records
from tests.scenarios.session_info import INFO

WORLD = np.diag((-1.0, -1.0, 1.0, 1.0))


def recorded(folder: Path, times: list[float], sha256: str) -> list[SampleRecord]:
    """Record a flight with odd numbers in it; give what was recorded."""
    scenario = Scenario("s", "S", "s.path.json")
    info = msgspec.structs.replace(
        INFO,
        scenario=msgspec.json.encode(scenario).decode(),
        world_from_device=WORLD.ravel().tolist(),
        registration_rms_mm=0.3,
        surface_sha256=sha256,
    )
    rng = np.random.default_rng(4)
    control = FulcrumControl(Fulcrum(rng.normal(size=3), np.array((0.0, 0.9, 0.4))))
    records = []
    for time_s in times:
        control.advance(0.01, Demand(*rng.uniform(-1, 1, 4)))
        roll, tip, pointing = rng.normal(), rng.normal(size=3), rng.normal(size=3)
        buttons = int(rng.integers(4))
        sample = Sample(time_s, control.frame(), float(roll), tip, pointing, buttons)
        records.append(SampleRecord.of(sample))
    write_records(folder, info, records)
    return records


def played(chosen: RecordingInput, patient: PatientScene) -> list[SampleRecord]:
    with chosen.open(patient) as source:
        return [SampleRecord.of(chosen.completer.complete(pose)) for pose in source]


def test_a_session_comes_back_bit_for_bit(
    tmp_path: Path, bare_room: PatientScene
) -> None:
    times = [0.0, 0.011, 0.02, 0.1, 0.1 + 1e-9, 0.3]
    records = recorded(tmp_path / "a.paravol", times, bare_room.surface_sha256)
    chosen = RecordingInput(tmp_path / "a.paravol")
    assert chosen.has_instrument
    assert chosen.until_s == 0.3
    assert chosen.registration is not None
    assert np.array_equal(chosen.registration.world_from_device, WORLD)
    assert chosen.registration.residual_rms_mm == 0.3
    # Encoded floats keep all their bits, so equal text is equal bits.
    assert msgspec.json.encode(played(chosen, bare_room)) == msgspec.json.encode(
        records
    )


def test_of_several_samples_at_a_time_the_first_is_kept(
    tmp_path: Path, bare_room: PatientScene
) -> None:
    records = recorded(tmp_path / "a", [0.0, 0.1, 0.1, 0.2], "0123")
    got = played(RecordingInput(tmp_path / "a"), bare_room)
    assert got == [records[0], records[1], records[3]]


def test_a_path_is_played_in_the_patient(
    tmp_path: Path, bare_room: PatientScene, exercise: tuple[Scenario, ProbePath]
) -> None:
    _, whole = exercise
    path = part_of(whole, "part", 0.0, whole.t_s[19])
    save_probe_path(path, tmp_path / "part.path.json")
    chosen = RecordingInput(tmp_path / "part.path.json")
    assert chosen.name == "recording part.path.json"
    for i, record in enumerate(played(chosen, bare_room)):
        sample = record.sample()
        assert sample.time_s == path.t_s[i]
        assert np.array_equal(sample.device_from_tip[:3, 3], path.tip_mm[i])
        assert -sample.device_from_tip[:3, 2] == pytest.approx(path.axis[i], abs=1e-5)
        assert sample.roll_deg == path.roll_deg[i]


def test_what_cannot_be_played_is_refused_before_anything_slow(
    tmp_path: Path, bare_room: PatientScene
) -> None:
    recorded(tmp_path / "other", [0.0, 0.1], "another head")
    with pytest.raises(ValueError, match="another head"):
        RecordingInput(tmp_path / "other").open(bare_room)
    recorded(tmp_path / "back", [0.0, 0.2, 0.1], "0123")
    with pytest.raises(ValueError, match="pose 2"):
        RecordingInput(tmp_path / "back")
    recorded(tmp_path / "empty", [], "0123")
    with pytest.raises(ValueError, match="no pose"):
        RecordingInput(tmp_path / "empty")
    (tmp_path / "folder").mkdir()
    with pytest.raises(ValueError, match="not a session"):
        RecordingInput(tmp_path / "folder")
