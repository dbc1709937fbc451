"""The demo end to end, on two seconds of the flight and a small picture."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from app.__main__ import main
from scenarios.bundle import EventRecord, FrameRecord, SampleRecord, read_session

SIZE = 96

# The reading half of imageio-ffmpeg 0.8 leaves its pipes to the garbage collector.
pytestmark = pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)


@pytest.fixture(scope="module")
def flown(short_scenario: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("a demo")  # with a blank in its name
    status = main(
        [
            *f"demo --size {SIZE} --ranks 1 --threads 2".split(),
            *("--scenario", str(short_scenario), "--out", str(out)),
        ]
    )
    assert status == 0
    return out


def summary_of(out: Path) -> dict[str, Any]:
    result: dict[str, Any] = json.loads((out / "summary.json").read_text())
    return result


def pixels(file: Path) -> NDArray[np.uint8]:
    with Image.open(file) as image:
        return np.asarray(image)


def test_summary_holds_what_was_measured(flown: Path) -> None:
    summary = summary_of(flown)
    info, records, complete = read_session(flown / "flight.paravol")
    frames = [r for r in records if isinstance(r, FrameRecord)]
    samples = [r for r in records if isinstance(r, SampleRecord)]
    assert complete
    assert summary["frames"] == len(frames) > 5
    assert summary["replay"] == {
        "exact": True,
        "frames": len(frames),
        "differing_frames": 0,
        "same_score": True,
    }
    # the arm is polled at 100 Hz for 2 s and every pose is kept; a busy machine polls
    # more slowly
    assert 100 < len(samples) <= 205
    assert summary["registration_rms_mm"] == info.registration_rms_mm < 0.3
    for key in ("frame_ms", "pose_age_ms"):
        spread = summary[key]
        assert 0 < spread["p50"] <= spread["p95"] <= spread["p99"]
    assert summary["splats"] > 10_000
    assert summary["path_length_mm"] > 1
    result = json.loads((flown / "flight.paravol" / "result.json").read_text())
    for name in ("contacts", "contact_s", "worst_depth_mm", "touched_s"):
        assert summary[name] == result["score"][name]
    assert summary["versions"]["python"].startswith("3.")
    assert min(r.clearance_mm for r in frames) >= summary["min_clearance_mm"]


def test_poses_are_those_of_the_path(flown: Path, short_scenario: Path) -> None:
    from devices import load_probe_path

    path = load_probe_path(short_scenario.with_name("short.path.json"))
    info, records, _ = read_session(flown / "flight.paravol")
    matrix = np.array(info.world_from_device).reshape(4, 4)
    errors = []
    for record in records:
        if isinstance(record, SampleRecord):
            sample = record.sample()
            tip = (matrix @ sample.device_from_tip)[:3, 3]
            errors.append(np.linalg.norm(tip - path.sample(sample.time_s).tip_mm))
    # rounding to counts alone gives .106 mm rms; registration adds little
    assert float(np.sqrt(np.mean(np.square(errors)))) < 0.3


def test_snapshot_is_the_live_view(flown: Path) -> None:
    taken = summary_of(flown)["snapshots"]
    assert [s["name"] for s in taken] == ["middle turbinate"]
    assert taken[0]["ranks"] == 1
    assert taken[0]["seconds"] > 0
    assert taken[0]["ssim"] > 0.8
    folder = flown / "snapshots"
    snapshot = pixels(folder / taken[0]["file"])
    assert snapshot.shape == (SIZE, SIZE, 3)
    live = pixels(folder / "middle-turbinate-live.png")
    difference = snapshot.astype(float) - live
    rms = float(np.sqrt(np.mean(np.square(difference))))
    assert taken[0]["rmse"] == pytest.approx(rms)
    red, green, _ = snapshot.reshape(-1, 3).mean(axis=0)
    assert red > 1.2 * green  # mucosa, not a grey or black picture
    assert pixels(folder / "middle-turbinate-error.png").shape[1] == 3 * SIZE


def test_film_lasts_as_long_as_the_flight(flown: Path) -> None:
    import imageio_ffmpeg

    frames, seconds = imageio_ffmpeg.count_frames_and_secs(flown / "flight.mp4")
    _, records, _ = read_session(flown / "flight.paravol")
    last_s = max(r.time_s for r in records if isinstance(r, SampleRecord))
    assert last_s == pytest.approx(2.0, abs=0.15)
    # to a frame of the film, of which thirty are a second
    assert seconds == pytest.approx(last_s, abs=1 / 30 + 0.01)
    assert frames == pytest.approx(30 * last_s, abs=1.01)


def test_replay_checks_every_frame(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bundle = flown / "flight.paravol"
    assert main(["replay", str(bundle), "--check", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["is_exact"] is True
    # a result that does not belong to the poses is found
    changed = tmp_path / "changed.paravol"
    changed.mkdir()
    for name in ("session.json", "stream.mcap"):
        (changed / name).write_bytes((bundle / name).read_bytes())
    result = json.loads((bundle / "result.json").read_text())
    result["score"]["min_clearance_mm"] += 0.5
    (changed / "result.json").write_text(json.dumps(result))
    assert main(["replay", str(changed), "--check", "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["same_score"] is False
    assert report["differing_frames"] == []
    # and so is a structure that was not the one touched
    result = json.loads((bundle / "result.json").read_text())
    result["score"]["worst_structure"] = "elsewhere"
    (changed / "result.json").write_text(json.dumps(result))
    assert main(["replay", str(changed), "--check", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["same_score"] is False
    # a recording from before contacts were described has fewer figures; pictures of
    # another look are not held against it, and it says so
    for name in ("contact_s", "pressure_s", "worst_depth_mm", "touched_s"):
        del result["score"][name]
    (changed / "result.json").write_text(json.dumps(result))
    session = json.loads((bundle / "session.json").read_text())
    assert session["visible_sets"] is False
    del session["look"], session["structures_sha256"], session["automatic"]
    (changed / "session.json").write_text(json.dumps(session))
    assert main(["replay", str(changed), "--check", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["same_look"], report["is_exact"]) == (False, True)
    assert report["same_score"] is True
    assert main(["replay", str(changed)]) == 0
    assert "not compared" in capsys.readouterr().out


@pytest.mark.slow
def test_unplugging_in_flight_keeps_the_recording(
    coarse_scenario: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # ten seconds after the first poll: the fiducials take about seven
    status = main(
        [
            *f"demo --size {SIZE} --ranks 1 --fault unplug@10".split(),
            *("--scenario", str(coarse_scenario), "--out", str(tmp_path)),
        ]
    )
    told = capsys.readouterr().err.strip().splitlines()[-1]
    assert status == 1
    assert told.startswith("paravol: ")
    assert "can be replayed" in told
    _, records, complete = read_session(tmp_path / "flight.paravol")
    assert complete  # closed properly, only earlier
    assert any(isinstance(r, EventRecord) and r.kind == "device" for r in records)
    assert sum(isinstance(r, SampleRecord) for r in records) > 20
    assert not (tmp_path / "flight.paravol" / "result.json").exists()
    assert main(["replay", str(tmp_path / "flight.paravol"), "--check"]) == 0
