"""Pictures of a session that was flown through a case, wherever that lies now."""

import io
import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import OpenEXR
import pytest
import SimpleITK
from numpy.typing import NDArray
from PIL import Image

from anatomy.case import write_case
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import build_phantom
from app.__main__ import main
from devices import load_probe_path
from paravol.exercises.case_scenario import scenario_of_case
from paravol.patient import load_patient
from paravol.snapshots.view_file import ViewFile
from scenarios import Sample, load_scenario, tip_frame
from scenarios.bundle import SampleRecord
from tests.recorded_flight import info_of, write_records

SIZE = 48


def nose(folder: Path, seed: int) -> Path:
    """A coarse nose as a case."""
    box = ((-16.0, 16.0), (-24.0, 62.0), (-12.0, 40.0))
    write_case(build_phantom(PhantomParameters(seed=seed), 1.5, field_mm=box), folder)
    return folder


def session_through(case: Path, folder: Path) -> Path:
    """Record one sample in the middle of the case's exercise."""
    scenario, place = load_scenario(str(scenario_of_case(case)))
    patient = load_patient(scenario, lambda stage, share: None)
    path = load_probe_path(place / scenario.path)
    at = path.sample(0.4 * path.duration_s)
    sample = Sample(
        1.0, tip_frame(at.tip_mm, at.axis), at.roll_deg, at.tip_mm, at.axis, 0
    )
    info = info_of(scenario, patient, size=SIZE, operates=False)
    return write_records(folder, info, [SampleRecord.of(sample)])


@pytest.mark.slow
def test_a_session_in_a_case_is_pictured_even_when_the_case_has_moved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = nose(tmp_path / "case", 1)
    session = session_through(case, tmp_path / "s.paravol")
    out = tmp_path / "a.png"
    words = ["snapshot", str(session), "--size", str(SIZE), "--out", str(out)]
    assert main(words) == 0
    here = pixels_of(out)
    assert here.std() > 5
    assert main([*words, "--time", "90"]) == 1
    assert "ends after 1.0 s and has nothing at 90 s" in capsys.readouterr().err
    moved = case.rename(tmp_path / "elsewhere")
    assert main(words) == 1
    assert "say with --case where it lies now" in capsys.readouterr().err
    assert main([*words, "--case", str(moved)]) == 0
    assert np.array_equal(pixels_of(out), here)
    assert main([*words, "--case", str(moved), "--classic"]) == 0
    assert not np.array_equal(pixels_of(out), here)
    other = nose(tmp_path / "other", 2)
    assert main([*words, "--case", str(other)]) == 1
    assert "was flown through another head" in capsys.readouterr().err


def pixels_of(source: Path | io.BytesIO) -> NDArray[np.uint8]:
    with Image.open(source) as image:
        return np.asarray(image.convert("RGB"))


def text_of(file: Path) -> dict[str, str]:
    with Image.open(file) as image:
        return {str(key): str(value) for key, value in image.info.items()}


def phantom_view(folder: Path) -> Path:
    """A view of a coarse nose, as a file; the nose is a case beside it."""
    case, view = nose(folder / "case", 1), folder / "a.view.json"
    words = ["snapshot", "--case", str(case), "--time", "2", "--size", str(SIZE)]
    words += ["--samples", "1", "--out", str(folder / "first.png")]
    assert main([*words, "--save-view", str(view)]) == 0
    return view


@pytest.mark.slow
def test_one_view_becomes_every_kind_of_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As a new user would: formats, comparisons, maps, pairs and films of one view."""
    view = phantom_view(tmp_path)
    words = ["snapshot", "--view", str(view), "--samples", "1"]
    out = tmp_path / "again.png"
    files = [tmp_path / f"a.{ending}" for ending in ("exr", "nrrd")]
    outs = [word for file in (out, *files) for word in ("--out", str(file))]
    capsys.readouterr()
    words_for_all = [*words, *outs, "--against", "fsr", "--json"]
    assert main([*words_for_all, "--confidence", str(tmp_path / "doubt.nrrd")]) == 0
    report = json.loads(capsys.readouterr().out)
    pixels = pixels_of(out)
    assert np.array_equal(pixels, pixels_of(tmp_path / "first.png"))
    text = text_of(out)
    assert text["Complete"] == "yes"
    assert msgspec.json.decode(text["View"], type=ViewFile).size_px == (SIZE, SIZE)
    with OpenEXR.File(str(files[0])) as file:
        channels = file.channels()
        assert channels["RGBA"].pixels.shape == (SIZE, SIZE, 4)
        assert np.array_equal(np.unique(channels["samples"].pixels), [1])
        depth = channels["Z"].pixels
    found = SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(str(files[1])))
    assert np.array_equal(found, depth)
    doubt = SimpleITK.GetArrayFromImage(
        SimpleITK.ReadImage(str(tmp_path / "doubt.nrrd"))
    )
    assert doubt.shape == (SIZE, SIZE)
    assert 0 <= doubt.min() <= doubt.max() <= 1
    assert 0 < report["confidence"]["sure"] <= 1
    assert report["against"]["codes"]["ssim"] > 0.9
    assert pixels_of(Path(report["against"]["file"])).shape[1] == 3 * SIZE

    assert main([*words, "--size", "32", "--out", str(tmp_path / "small.png")]) == 0
    assert pixels_of(tmp_path / "small.png").shape == (32, 32, 3)

    assert main([*words, "--stereo", "1", "--out", str(out)]) == 0
    pair = pixels_of(out)
    assert pair.shape == (SIZE, 2 * SIZE, 3)
    assert not np.array_equal(pair[:, :SIZE], pair[:, SIZE:])

    keys = [
        {"time_s": t, "eye_mm": [-6, -10 + t, -5], "target_mm": [0, 1, 0]}
        for t in (0, 1)
    ]
    path = tmp_path / "p.json"
    path.write_text(json.dumps({"schema": "paravol.camera-path/1", "keys": keys}))
    film, folder = tmp_path / "f.mp4", tmp_path / "frames"
    row = [*words, "--camera-path", str(path), "--fps", "2", "--out", str(folder)]
    assert main([*row, "--out", str(film)]) == 0
    names = sorted(p.name for p in folder.iterdir())
    assert names == [f"frame-{n:05d}.png" for n in (1, 2, 3)]
    assert film.stat().st_size > 500
    assert main(row) == 1
    assert "already holds pictures of a row" in capsys.readouterr().err


@pytest.mark.slow
def test_a_tool_in_mode_classic_is_in_every_kind_of_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By one process and by ranks, in a film, in a pair, and out of time."""
    file = phantom_view(tmp_path)
    view = msgspec.json.decode(file.read_bytes(), type=ViewFile)
    frame = view.to_camera().frame
    pose = np.stack([frame[1], frame[2], -frame[3], frame[0] + 6 * frame[3]], axis=1)
    # right, up, backward: right-handed; its shaft leaves the view to the side
    turn = np.deg2rad(40)
    pose[:, 2] = np.cos(turn) * -frame[3] + np.sin(turn) * frame[1]
    pose[:, 0] = np.cross(pose[:, 1], pose[:, 2])
    tool = {"name": "suction tube", "world_from_instrument": pose.tolist()}
    record = msgspec.to_builtins(view) | {"instruments": [tool]}
    file.write_text(json.dumps(record))
    armed = tmp_path / "b.view.json"
    armed.write_text(json.dumps(record | {"look": {"mode": "classic"}}))
    bare = tmp_path / "c.view.json"
    bare.write_text(
        json.dumps(record | {"look": {"mode": "classic"}, "instruments": []})
    )
    out = tmp_path / "out.png"

    def shot(*words: str) -> NDArray[np.uint8]:
        assert main(["snapshot", *words, "--samples", "1", "--out", str(out)]) == 0
        return pixels_of(out)

    plain = shot("--view", str(armed))
    without = shot("--view", str(bare))
    met = np.any(plain != without, axis=-1)
    assert 0.05 < met.mean() < 0.7
    # metal is grey, and tissue is not
    colour = plain[met].max(axis=-1).astype(int) - plain[met].min(axis=-1)
    assert np.median(colour) < 10
    assert np.array_equal(shot("--view", str(file), "--classic"), plain)
    assert np.array_equal(shot("--view", str(armed), "--ranks", "2"), plain)
    pair = shot("--view", str(armed), "--stereo", "0.5")
    assert pair.shape == (SIZE, 2 * SIZE, 3)
    large = ["--size", "192"]
    fine, clear = (shot("--view", str(each), *large) for each in (armed, bare))
    large += ["--quality", "reference", "--time-limit", "0.01"]
    hurried = shot("--view", str(armed), *large).astype(int)
    assert text_of(out)["Complete"] == "no: stopped early"
    within = np.any(fine != clear, axis=-1)
    off, missing = (np.abs(hurried - each)[within].mean() for each in (fine, clear))
    assert off < 0.5 * missing
    eye, forward = frame[0], frame[3]
    keys = [
        {
            "time_s": t,
            "eye_mm": (eye - 0.5 * t * forward).tolist(),
            "target_mm": (eye + 5 * forward).tolist(),
        }
        for t in (0, 1)
    ]
    path, folder = tmp_path / "p.json", tmp_path / "frames"
    path.write_text(json.dumps({"schema": "paravol.camera-path/1", "keys": keys}))
    words = ["--view", str(armed), "--camera-path", str(path), "--fps", "1"]
    assert main(["snapshot", *words, "--samples", "1", "--out", str(folder)]) == 0
    frames = [pixels_of(file) for file in sorted(folder.iterdir())]
    assert len(frames) == 2
    assert np.median(np.ptp(frames[0][met].astype(int), axis=-1)) < 10
    assert not np.array_equal(frames[0], frames[1])
    capsys.readouterr()
    assert (
        main(["snapshot", "--view", str(armed), "--path-traced", "--out", str(out)])
        == 1
    )
    assert "--path-traced is about the endoscope's light" in capsys.readouterr().err


@pytest.mark.slow
def test_light_by_paths_stops_goes_on_and_judges_the_quick_light(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    view = phantom_view(tmp_path)
    state, out = tmp_path / "s.npz", tmp_path / "t.png"
    words = ["snapshot", "--view", str(view), "--samples", "1", "--path-traced"]
    words += ["--out", str(out), "--state", str(state), "--json"]
    capsys.readouterr()
    noise = []
    for paths in ("32", "64"):
        assert main([*words, "--path-samples", paths, "--against", "fast"]) == 0
        report = json.loads(capsys.readouterr().out)
        noise.append(report["result"]["noise"])
        assert 0 < report["against"]["light"] < 0.5
    assert noise[1] < noise[0]
    went_on = out.read_bytes()
    state.unlink()
    assert main([*words, "--path-samples", "64"]) == 0
    assert np.array_equal(pixels_of(out), pixels_of(io.BytesIO(went_on)))
    other = json.loads(view.read_text())
    other["camera"]["eye_mm"][1] += 1
    view.write_text(json.dumps(other))
    assert main([*words, "--path-samples", "64"]) == 1
    assert "of another view, head or quality" in capsys.readouterr().err


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Let programs begun by a test hear Ctrl-C, though the tests themselves may not.

    A shell's script has what it starts in the background ignore it, and that is
    inherited.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
def test_out_of_time_or_interrupted_there_is_the_best_picture_so_far(
    tmp_path: Path,
) -> None:
    view = phantom_view(tmp_path)
    out = tmp_path / "t.png"
    words = ["snapshot", "--view", str(view), "--samples", "1", "--path-traced"]
    words += ["--out", str(out), "--path-samples", "1000000"]
    assert main([*words, "--time-limit", "1"]) == 0
    assert text_of(out)["Complete"] == "no: stopped early"
    assert pixels_of(out).std() > 5
    out.unlink()
    child = subprocess.Popen(
        [sys.executable, "-m", "app", *words], stderr=subprocess.PIPE
    )
    try:
        assert child.stderr is not None
        for line in child.stderr:
            if b"Rendering" in line:
                break
        time.sleep(2.0)
        child.send_signal(signal.SIGINT)
        assert child.wait(120) == 130
    finally:
        child.kill()
        child.communicate()
    assert text_of(out)["Complete"] == "no: stopped early"
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]
