"""A view that was saved while flying is the view that was flown."""

import json
from pathlib import Path

import numpy as np
import pytest

from app.__main__ import main
from devices import load_probe_path
from paravol.inputs.flight_input import in_the_patient
from paravol.patient import OperatingRoom, prepare_room
from paravol.session_info import LIVE_TIER, SEED, describe_session
from paravol.session_setup import build_session, build_view
from paravol.snapshots.view_file import ScopeLook, load_view
from paravol.view_keeper import ViewKeeper
from scenarios import Sample, Scenario, load_scenario, tip_frame
from scenarios.bundle import FrameRecord, SampleRecord, SessionRecorder

SIZE = 48
TIMES_S = (1.0, 1.5)


@pytest.fixture(scope="module")
def place(coarse_scenario: Path) -> tuple[Scenario, OperatingRoom, list[Sample]]:
    scenario, folder = load_scenario(str(coarse_scenario))
    path = load_probe_path(folder / scenario.path)
    samples = []
    for time_s in TIMES_S:
        at = path.sample(time_s)
        frame = tip_frame(at.tip_mm, at.axis)
        samples.append(
            Sample(
                time_s, frame, at.roll_deg, at.instrument_tip_mm, at.instrument_axis, 0
            )
        )
    return scenario, prepare_room(scenario, lambda stage, share: None), samples


def test_the_window_and_a_replay_save_the_view_that_was_seen(
    place: tuple[Scenario, OperatingRoom, list[Sample]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Flown, saved by either way, read again: the camera has the same bits."""
    scenario, room, samples = place
    registration = in_the_patient()
    info = describe_session(
        scenario, room, registration, size=SIZE, has_instrument=True
    )
    record = tmp_path / "flight.paravol"
    session = build_session(
        scenario, room, registration.world_from_device, (SIZE, SIZE)
    )
    drawer = build_view(
        scenario, room, tier=LIVE_TIER, seed=SEED, has_instrument=True, threads=1
    )
    keeper = ViewKeeper(scenario, room, record, has_instrument=True)
    files = []
    with SessionRecorder(record, info) as recorder:
        for number, sample in enumerate(samples):
            session.step(sample)
            seen = session.view(sample)
            frame = drawer.draw(seen, number=number, elapsed_s=0.1)
            recorder.add(SampleRecord.of(sample))
            recorder.add(
                FrameRecord(
                    number, number, frame.gain, seen.clearance_mm, frame.fingerprint()
                )
            )
            said, where = keeper.keep(seen, frame, sample, number)
            assert said == f"Saved the view at {sample.time_s:.1f} s"
            files.append(Path(where))
            view = load_view(Path(where))
            assert view.to_camera().key == seen.camera.key
            assert isinstance(view.look, ScopeLook)
            assert (view.look.gain, view.look.frame_number) == (frame.gain, number)
            tool = np.array(view.instruments[0].world_from_instrument)
            assert np.array_equal(tool, seen.world_from_instrument[:3])
            # and drawn from the file alone it is the frame, to the last bit
            again = drawer.gbuffer(seen)
            lit = drawer.light(seen, again)
            pixels = drawer.expose(
                seen, again, lit, gain=view.look.gain or 0.0, number=number
            )
            assert np.array_equal(pixels, frame.pixels)
        recorder.close({})
    assert files[0].parent == record / "snapshots"
    out = tmp_path / "replayed.view.json"
    for sample, file in zip(samples, files, strict=True):
        words = ["replay", str(record), "--view-at", str(sample.time_s)]
        assert main([*words, "--out", str(out)]) == 0
        assert "paravol snapshot --view" in capsys.readouterr().out
        assert json.loads(out.read_text()) == json.loads(file.read_text())


def test_a_disk_that_refuses_is_told_and_ends_nothing(
    place: tuple[Scenario, OperatingRoom, list[Sample]], tmp_path: Path
) -> None:
    scenario, room, samples = place
    (tmp_path / "snapshots").write_text("no folder")
    session = build_session(scenario, room, np.eye(4), (SIZE, SIZE))
    seen = session.view(samples[0])
    drawer = build_view(
        scenario, room, tier=LIVE_TIER, seed=SEED, has_instrument=False, threads=1
    )
    frame = drawer.draw(seen, number=0, elapsed_s=0.0, gain=1.0)
    keeper = ViewKeeper(scenario, room, tmp_path, has_instrument=False)
    said, why = keeper.keep(seen, frame, samples[0], 0)
    assert said == "The view was not saved"
    assert "snapshots" in why


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--view-at", "1"], "--view-at and --out go together"),
        (["--out", "a.view.json"], "--view-at and --out go together"),
        (["--case", "somewhere"], "--case goes with --view-at"),
        (["--view-at", "-1", "--out", "a.view.json"], "seconds from 0 on, got -1"),
    ],
)
def test_half_a_wish_is_refused(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", "nothing.paravol", *words]) == 1
    assert message in capsys.readouterr().err
