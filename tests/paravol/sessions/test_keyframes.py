"""Whatever is gone through, a frame has the bits of a run from the start."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from paravol.patient import PatientScene, no_progress
from paravol.sessions.session_pictures import SessionPictures
from paravol.sessions.session_replay import replay_session
from scenarios import load_scenario
from scenarios.bundle import FrameRecord, read_recording
from tests.paravol.operated_head import head_round_an_orbit
from tests.paravol.sessions.recorded_operations import (
    COUNT,
    EVERY_S,
    OPERATIONS,
    SIZES,
    record_operation,
)
from tests.slow_cases import slow

FRAMES = COUNT // 3


@dataclass
class Recorded:
    """A recorded operation, what is shown of it, and the frames of the flight."""

    folder: Path = field(repr=False)
    patient: PatientScene = field(repr=False)
    shown: SessionPictures
    frames: list[FrameRecord] = field(repr=False)


BY_NAME = [
    # what changes stands for what is shaved, too, where time is short
    name if name == "changing" else pytest.param(name, marks=pytest.mark.slow)
    for name in OPERATIONS
]


@pytest.fixture(scope="module", params=BY_NAME)
def recorded(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Recorded:
    patient = head_round_an_orbit(load_scenario("first_flight")[0])
    folder = tmp_path_factory.mktemp("recorded") / f"{request.param}.paravol"
    record_operation(folder, patient, OPERATIONS[request.param])
    shown = SessionPictures(folder, progress=no_progress, threads=1, patient=patient)
    records = read_recording(folder).records
    frames = [r for r in records if isinstance(r, FrameRecord)]
    assert {frame.size_of(SIZES[:2])[0] for frame in frames} == set(SIZES)
    assert len({frame.xxh3_128 for frame in frames}) == len(frames)
    return Recorded(folder, patient, shown, frames)


def test_a_run_from_the_start_is_exact(recorded: Recorded) -> None:
    report = replay_session(recorded.folder, threads=1, patient=recorded.patient)
    assert report.is_exact
    assert report.score.operation is not None
    assert report.score.operation.edits > 10


@pytest.mark.parametrize("jumps", [12, *slow(40)])
def test_after_any_jumps_a_frame_has_the_bits_of_the_flight(
    recorded: Recorded, jumps: int
) -> None:
    random = np.random.default_rng(1)
    for number in [0, FRAMES - 1, 0, *random.integers(0, FRAMES, jumps).tolist()]:
        frame = recorded.frames[number]
        moment = recorded.shown.moment(3 * number * EVERY_S + EVERY_S / 3)
        assert moment.recorded == frame
        assert moment.frame.fingerprint() == frame.xxh3_128
        assert moment.is_recorded
