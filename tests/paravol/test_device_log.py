"""An arm that is unplugged in flight, in the window and in its recording."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageColor

from app.window.style import ALARM
from devices.microscribe import MicroScribeEmulator
from paravol.replay import replay_session
from scenarios import load_scenario
from scenarios.bundle import EventRecord, SampleRecord, read_session

pytestmark = pytest.mark.display

Train = Callable[..., tuple[subprocess.CompletedProcess[str], list[int]]]


@pytest.mark.slow
def test_an_arm_that_was_unplugged_goes_on_when_it_is_back(
    train: Train, coarse_scenario: Path, tmp_path: Path
) -> None:
    bundle, link = tmp_path / "flight.paravol", tmp_path / "arm"
    scenario, folder = load_scenario(str(coarse_scenario))
    fiducials = np.array([f.position_mm for f in scenario.fiducials])
    # the fiducials take seven seconds
    with MicroScribeEmulator(
        folder / scenario.path,
        fiducials_mm=fiducials,
        actions=("unplug@9+1",),
        link=link,
    ):
        done, left = train(
            *("--scenario", str(coarse_scenario), "--device", str(link)),
            *("--record", str(bundle), "--seconds", "9"),
        )
    assert (done.returncode, done.stderr) == (0, "")
    assert not left
    _, records, complete = read_session(bundle)
    assert complete
    samples = [r.time_s for r in records if isinstance(r, SampleRecord)]
    told = [r for r in records if isinstance(r, EventRecord) and r.kind == "device"]
    assert ["went away" in told[0].text, "is back" in told[1].text] == [True, True]
    # the arm's own time went on
    longest = int(np.argmax(np.diff(samples)))
    before_s, after_s = samples[longest : longest + 2]
    assert after_s - before_s > 1.0
    assert [event.time_s for event in told[:2]] == pytest.approx(
        [before_s, after_s], abs=0.05
    )
    assert min(longest, len(samples) - longest) > 20
    report = replay_session(bundle, threads=1, progress=lambda stage, share: None)
    assert report.is_exact
    assert report.samples == len(samples)


@pytest.mark.slow
def test_an_arm_that_stays_away_leaves_a_picture_that_says_so(
    train: Train, coarse_scenario: Path, tmp_path: Path
) -> None:
    shot, bundle = tmp_path / "shot.png", tmp_path / "flight.paravol"
    scenario, folder = load_scenario(str(coarse_scenario))
    fiducials = np.array([f.position_mm for f in scenario.fiducials])
    with MicroScribeEmulator(
        folder / scenario.path, fiducials_mm=fiducials, faults=("unplug@9",)
    ) as arm:
        done, left = train(
            *("--scenario", str(coarse_scenario), "--device", arm.port_name),
            *("--record", str(bundle), "--seconds", "8", "--screenshot", str(shot)),
        )
    assert (done.returncode, done.stderr) == (0, "")
    assert not left
    _, records, complete = read_session(bundle)
    assert complete
    (told,) = (i for i, record in enumerate(records) if "went away" in str(record))
    assert isinstance(records[told], EventRecord)
    # The picture of the last pose may still have been on its way.
    assert not any(isinstance(record, SampleRecord) for record in records[told:])
    # the picture stays, with the ring of an alarm round it
    with Image.open(shot) as picture:
        pixels = np.asarray(picture.convert("RGB"), dtype=np.float64)
    height, width = pixels.shape[:2]
    assert pixels[height // 4 : height * 5 // 8, width // 6 : width * 4 // 10].std() > 5
    ring = np.abs(pixels - np.array(ImageColor.getrgb(ALARM))).max(axis=-1) < 8
    assert ring.sum() > 2000
    report = replay_session(bundle, threads=2, progress=lambda stage, share: None)
    assert report.frames > 0
    assert report.is_exact
