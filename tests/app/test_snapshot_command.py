"""Pictures of a session that was flown through a case, wherever that lies now."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from anatomy.case import write_case
from anatomy.parameters import PhantomParameters
from anatomy.phantom import build_phantom
from app.__main__ import main
from app.case_exercise import exercise_of
from app.inputs.flight_input import in_the_patient
from app.operating_room import prepare_room
from app.session_info import describe_session
from devices import load_probe_path
from scenarios import Sample, load_scenario, tip_frame
from scenarios.bundle import SampleRecord, SessionRecorder

SIZE = 48


def nose(folder: Path, seed: int) -> Path:
    """A coarse nose as a case."""
    box = ((-16.0, 16.0), (-24.0, 62.0), (-12.0, 40.0))
    write_case(build_phantom(PhantomParameters(seed=seed), 1.5, field_mm=box), folder)
    return folder


def session_through(case: Path, folder: Path) -> Path:
    """Record one sample in the middle of the case's exercise."""
    scenario, place = load_scenario(str(exercise_of(case)))
    room = prepare_room(scenario, lambda stage, share: None)
    path = load_probe_path(place / scenario.path)
    at = path.sample(0.4 * path.duration_s)
    sample = Sample(
        1.0, tip_frame(at.tip_mm, at.axis), at.roll_deg, at.tip_mm, at.axis, 0
    )
    info = describe_session(
        scenario, room, in_the_patient(), size=SIZE, has_instrument=False
    )
    with SessionRecorder(folder, info) as recorder:
        recorder.add(SampleRecord.of(sample))
        recorder.close({})
    return folder


@pytest.mark.slow
def test_a_session_in_a_case_is_pictured_even_when_the_case_has_moved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = nose(tmp_path / "case", 1)
    session = session_through(case, tmp_path / "s.paravol")
    out = tmp_path / "a.png"
    words = ["snapshot", str(session), "--size", str(SIZE), "--out", str(out)]
    assert main(words) == 0
    here = np.asarray(Image.open(out))
    assert here.std() > 5
    moved = case.rename(tmp_path / "elsewhere")
    assert main(words) == 1
    assert "say with --case where it lies now" in capsys.readouterr().err
    assert main([*words, "--case", str(moved)]) == 0
    assert np.array_equal(np.asarray(Image.open(out)), here)
    other = nose(tmp_path / "other", 2)
    assert main([*words, "--case", str(other)]) == 1
    assert "was flown through another head" in capsys.readouterr().err
