"""A flight's end: asked for, told, and on disk, whoever flies."""

import itertools
import json
import math
import shutil
import subprocess
import sys
import threading
import time
import zlib
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from PIL import Image, ImageColor

from app.__main__ import main
from app.window.style import ALARM
from devices import Pose, ProbePath, load_probe_path, save_probe_path
from devices.microscribe import MicroScribeEmulator
from paravol.flight import flight_events as events
from paravol.flight import flight_loop
from paravol.flight.flight import Flight, FlightOrder, save_frame_view
from paravol.flight.flight_loop import DeadlineBatch, FrameEvent, FramePacing, fly
from paravol.flight.picture_size import PictureSize
from paravol.inputs import choose_input
from paravol.inputs.flight_input import FlightInput
from paravol.patient import PatientScene, load_patient
from paravol.sessions import keyframes
from paravol.sessions.keyframes import Keyframes, load_keyframes
from paravol.sessions.session_replay import replay_session
from paravol.sessions.session_timeline import SessionTimeline
from paravol.snapshots.view_file import ScopeLook, load_view
from renderers.scene import Change, ChangeKind
from scenarios import Sample, Scenario, Score, load_scenario, tip_frame
from scenarios.bundle import (
    EditRecord,
    EventRecord,
    FrameRecord,
    SampleRecord,
    SessionRecorder,
    read_session,
)
from surgery.pushing import Pushing
from tests.flights import part_of
from tests.recorded_flight import Flight as Made

ROOT = Path(__file__).parents[3]
Train = Callable[..., tuple[subprocess.CompletedProcess[str], list[int]]]

TARGETS = 4


@pytest.mark.display
@pytest.mark.slow
@pytest.mark.parametrize("words", [[], ["--input", "emulator"]])
def test_a_flight_that_nobody_named_is_recorded_and_told(
    words: list[str],
    train: Train,
    coarse_scenario: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    # the clock waits for the first pictures
    done, left = train("--scenario", str(coarse_scenario), "--seconds", "6", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert not left
    (folder,) = (tmp_path / "paravol" / "sessions").iterdir()
    told = done.stdout
    assert f"Recorded in {folder}\n" in told
    assert f"paravol replay {folder}\n" in told
    for figure in ("path length", "smallest clearance", "contacts"):
        assert figure in told
    table, _, _ = told.partition("Recorded in ")
    assert table.count("nearest to: ") == TARGETS
    session = json.loads((folder / "session.json").read_text())
    assert session["automatic"] is True
    # The mouse steers where nobody says otherwise, and it holds no suction tube.
    assert session["has_instrument"] is bool(words)
    result = json.loads((folder / "result.json").read_text())
    assert len(result["score"]["target_distance_mm"]) == TARGETS
    assert result["timing"]["frames"] > 0
    if not words:
        assert main(["replay", str(folder), "--check"]) == 0


@pytest.mark.display
@pytest.mark.slow
def test_a_flight_that_cannot_be_kept_goes_on_and_says_so(
    train: Train, coarse_scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "paravol").write_text("a file where the folder should be")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    done, _ = train("--scenario", str(coarse_scenario), "--seconds", "1")
    assert (done.returncode, done.stderr) == (0, "")
    assert "path length" in done.stdout
    assert "Not recorded:" in done.stdout


ASK = """
import sys, time
from pathlib import Path
from PySide6.QtCore import QEventLoop, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment
prepare_environment()
from paravol.flight.flight import FlightOrder
from paravol.inputs import choose_input
from app.window.flight.flight_page import FlightPage
from app.window.flight.flight_thread import FlightThread
from app.window.session_thread import FrameReady
from app.window.main_window import MainWindow
from devices import Pose, ProbePath, load_probe_path, save_probe_path
from scenarios import load_scenario

application = QApplication([])
scenario, folder = load_scenario(sys.argv[1])
path = load_probe_path(folder / scenario.path)
mouse = choose_input(None, None, scenario, path, folder / scenario.path)
record = Path(sys.argv[2])
flight = FlightThread(FlightOrder(scenario, path, mouse, 64, 1, record))
window = MainWindow()
page = FlightPage(flight, edge_samples=0)
page.left.connect(window.shut)
window.show_page(page)
frames = []
flight.told.connect(
    lambda event: frames.append(0) if isinstance(event, FrameReady) else None
)
said = []
say = page.picture.say
def spoken(message, detail="", share=None):
    said.append(message)
    say(message, detail, share)
page.picture.say = spoken
window.show()
flight.start()

def until(what, holds):
    began = time.monotonic()
    while flight.error is None and not holds():
        assert time.monotonic() - began < 200.0, what
        loop = QEventLoop()
        QTimer.singleShot(20, loop.quit)
        loop.exec()
    assert flight.error is None, flight.error

def asked():
    return window.isVisible() and said[-1] == "End this flight?"

until("a frame", lambda: frames)
for key in (Qt.Key.Key_Q, Qt.Key.Key_Escape):
    QTest.keyClick(page, key)
    assert asked(), said
    # The flight goes on under the question, and notices do not hide it.
    QTest.keyClick(page, Qt.Key.Key_M)
    count = len(frames)
    until("more frames", lambda: len(frames) > count + 2)
    assert asked(), said
    QTest.keyClick(page, Qt.Key.Key_Escape)
    assert said[-1] == "" and window.isVisible()
QTest.keyClick(page, Qt.Key.Key_Return)  # answers nothing
count = len(frames)
until("more frames", lambda: len(frames) > count + 2)
# By the mouse: the window's own button asks, too.
window.close()
assert asked(), said
QTest.keyClick(page, Qt.Key.Key_Return)
until("the end", lambda: page.picture._result is not None)
assert window.isVisible()
assert flight.flight.result.title == "The flight is over"
assert len(flight.flight.result.score.target_distance_mm) == 4
window.grab().save(sys.argv[3])
QTest.keyClick(page, Qt.Key.Key_Q)
assert not window.isVisible()
assert flight.stop(60.0)
window.release()
"""


@pytest.mark.display
@pytest.mark.slow
def test_q_and_escape_ask_and_the_end_shows_the_result(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    record = tmp_path / "flight.paravol"
    done = subprocess.run(
        [
            *(sys.executable, "-c", ASK),
            *(str(coarse_scenario), str(record), str(tmp_path / "end.png")),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=240.0,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert (record / "result.json").is_file()
    assert json.loads((record / "session.json").read_text())["automatic"] is False


SIZE = 48
TIMES_S = (1.0, 1.5)


def played_scenario(file: Path) -> tuple[Scenario, ProbePath, FlightInput]:
    """Return an exercise, its path, and the input that plays it."""
    scenario, folder = load_scenario(str(file))
    path_file = folder / scenario.path
    path = load_probe_path(path_file)
    played = choose_input(f"recording:{path_file}", None, scenario, path, path_file)
    return scenario, path, played


@pytest.fixture
def never_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no pose be left out, and that be told, however slow the machine is."""

    def patient(allowed_s: float) -> DeadlineBatch:
        return DeadlineBatch(math.inf, math.inf)

    monkeypatch.setattr(flight_loop, "DeadlineBatch", patient)


def flight_order(scenario: Scenario, record: Path) -> FlightOrder:
    _, folder = load_scenario("first_flight")
    path_file = folder / "first_flight.path.json"
    path = load_probe_path(path_file)
    mouse = choose_input(None, None, scenario, path, path_file)
    return FlightOrder(scenario, path, mouse, SIZE, 1, record)


@pytest.fixture(scope="module")
def place(coarse_scenario: Path) -> tuple[Scenario, PatientScene, list[Sample]]:
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
    return scenario, load_patient(scenario, lambda stage, share: None), samples


def test_the_window_and_a_replay_save_the_view_that_was_seen(
    place: tuple[Scenario, PatientScene, list[Sample]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Flown, saved by either way, read again: the camera has the same bits."""
    scenario, patient, samples = place
    record = tmp_path / "flight.paravol"
    made = Made(scenario, patient, size=SIZE, operates=False, has_instrument=True)
    drawer = made.view
    order = flight_order(scenario, record)
    order.input.has_instrument = True
    files = []
    with made.recorded(record):
        for number, sample in enumerate(samples):
            made.step(sample)
            frame = made.show(SIZE, 0.1)
            seen = made.session.view(sample)
            event = FrameEvent(seen, frame, sample, number, 0.0)
            said, where = save_frame_view(order, patient, event)
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
    assert files[0].parent == record / "snapshots"
    out = tmp_path / "replayed.view.json"
    for sample, file in zip(samples, files, strict=True):
        words = ["replay", str(record), "--view-at", str(sample.time_s)]
        assert main([*words, "--out", str(out)]) == 0
        assert "paravol snapshot --view" in capsys.readouterr().out
        assert json.loads(out.read_text()) == json.loads(file.read_text())


class Turning(PictureSize):
    """Asks for another size with every frame."""

    turn = itertools.cycle((SIZE, 64, 40))

    def next(self) -> int:
        return next(self.turn)


@pytest.mark.slow
def test_frames_of_changing_size_are_recorded_and_replayed_to_the_bit(
    place: tuple[Scenario, PatientScene, list[Sample]], tmp_path: Path
) -> None:
    """And what is scored knows nothing of the size; a wrong size is noticed."""
    scenario, patient, samples = place
    made = Made(scenario, patient, size=SIZE, operates=False, has_instrument=True)
    info, session = made.info, made.session
    record, other = tmp_path / "flight.paravol", tmp_path / "other.paravol"
    flown = [replace(sample, time_s=0.1 * n) for n, sample in enumerate(samples * 4)]
    left = iter(flown)

    class Poses:
        def read(self, timeout_s: float) -> Pose:
            if timeout_s == 0.0:
                raise TimeoutError
            return Pose(0.0, time.monotonic(), np.eye(4), 0)

    def given(pose: Pose) -> Sample:
        return next(left, replace(flown[-1], time_s=99.0))

    shown: list[tuple[int, ...]] = []
    with SessionRecorder(record, info) as recorder:
        fly(
            Poses(),
            given,
            session,
            made.view,
            recorder,
            until_s=10.0,
            on_frame=lambda event: shown.append(event.frame.pixels.shape),
            keeps=lambda time_s: False,
            pace=FramePacing(sizes=Turning(SIZE)),
        )
        recorder.close({"score": asdict(session.score())})
    assert shown == [(n, n, 3) for n in (SIZE, 64, 40, SIZE, 64, 40, SIZE, 64)]
    _, records, _ = read_session(record)
    frames = [each for each in records if isinstance(each, FrameRecord)]
    # the session's own size need not be written
    assert [frame.size for frame in frames] == [0, 64, 40, 0, 64, 40, 0, 64]
    film = tmp_path / "film.mp4"
    report = replay_session(record, threads=2, patient=patient, video=film)
    assert report.is_exact
    assert report.same_score
    # a view is that of the frame, as large as it was shown
    out = tmp_path / "replayed.view.json"
    for each, edge in ((flown[1], 64), (flown[2], 40), (flown[3], SIZE)):
        words = ["replay", str(record), "--view-at", str(each.time_s)]
        assert main([*words, "--out", str(out)]) == 0
        assert load_view(out).to_camera().width == edge
    assert film.stat().st_size > 0
    with SessionRecorder(other, info) as recorder:
        for kept in records:
            if isinstance(kept, FrameRecord) and kept.size == 64:
                kept = msgspec.structs.replace(kept, size=40)
            recorder.add(kept)
        recorder.close({"score": asdict(session.score())})
    report = replay_session(other, threads=1, patient=patient)
    assert report.differing_frames == [1, 4, 7]


def test_a_disk_that_refuses_is_told_and_ends_nothing(
    place: tuple[Scenario, PatientScene, list[Sample]], tmp_path: Path
) -> None:
    scenario, patient, samples = place
    (tmp_path / "snapshots").write_text("no folder")
    made = Made(scenario, patient, size=SIZE, operates=False)
    seen = made.session.view(samples[0])
    frame = made.view.draw(seen, number=0, elapsed_s=0.0, gain=1.0)
    event = FrameEvent(seen, frame, samples[0], 0, 0.0)
    said, why = save_frame_view(flight_order(scenario, tmp_path), patient, event)
    assert said == "The view was not saved"
    assert "snapshots" in why


@pytest.mark.display
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


@pytest.mark.display
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
    ring = np.abs(pixels - np.array(ImageColor.getrgb(ALARM.name()))).max(axis=-1) < 8
    assert ring.sum() > 2000
    report = replay_session(bundle, threads=2, progress=lambda stage, share: None)
    assert report.frames > 0
    assert report.is_exact


class Kept:
    """Writes down what it hears, and asks for a moment and a view."""

    def __init__(self) -> None:
        self.flight: Flight | None = None
        self.heard: list[str] = []
        self.frames: list[FrameEvent] = []
        self.view = ""

    def hear(self, event: events.FlightEvent) -> None:
        match event:
            case events.HeadLoaded():
                self.heard.append("patient")
            case events.RecordingBegan(residual_mm):
                assert residual_mm is None
                self.heard.append("start")
                # of the first frame: a busy machine may not come to many
                if self.flight is not None:
                    self.flight.keep_moment()
                    self.flight.keep_view()
            case FrameEvent():
                self.frames.append(event)
            case events.MomentKept(frame):
                self.heard.append(f"moment of frame {frame.number}")
            case events.ViewSaved(_, where):
                self.view = where


class Exchanging(Kept):
    """Puts in an angled scope as soon as something was seen by the straight one."""

    def hear(self, event: events.FlightEvent) -> None:
        super().hear(event)
        if isinstance(event, FrameEvent):
            assert self.flight is not None
            self.flight.scope.choose(30.0)


@pytest.mark.parametrize("is_removed", [False, True])
def test_a_flight_goes_on_when_its_recording_cannot(
    short_scenario: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    is_removed: bool,
) -> None:
    """The disk is full, or somebody removes the folder: a score is due all the same."""
    scenario, path, played = played_scenario(short_scenario)
    record = tmp_path / "flight.paravol"
    heard: list[str] = []
    flush = SessionRecorder.flush

    def hear(event: events.FlightEvent) -> None:
        if isinstance(event, events.RecordingStopped):
            heard.append(event.why)
        if is_removed and isinstance(event, FrameEvent) and event.number == 1:
            shutil.rmtree(record)

    def filled(self: SessionRecorder) -> None:
        if not is_removed and self.samples > 40:
            raise OSError(28, "No space left on device")
        flush(self)

    monkeypatch.setattr(SessionRecorder, "flush", filled)
    flight = Flight(FlightOrder(scenario, path, played, SIZE, 1, record), hear)
    flown = flight.run()
    assert flown is not None
    result = flight.result
    assert result is not None
    assert result.score.duration_s == pytest.approx(path.t_s[-1], abs=0.05)
    if is_removed:
        assert result.record is None
        assert "was removed" in result.where()
        return
    (told,) = heard
    assert "No space left on device" in told
    assert "in part" in result.where()
    samples = [r for r in read_session(record)[1] if isinstance(r, SampleRecord)]
    assert 0 < len(samples) < len(path.t_s)


def test_a_flight_without_a_window_is_observed_recorded_and_replayed(
    never_behind: None, short_scenario: Path, tmp_path: Path
) -> None:
    scenario, path, played = played_scenario(short_scenario)
    record = tmp_path / "flight.paravol"
    observer, beside = Exchanging(), Kept()
    order = FlightOrder(
        scenario, path, played, SIZE, 1, record, watchers=(beside.hear,)
    )
    flight = Flight(order, observer.hear)
    observer.flight = flight
    flown = flight.run()
    assert flown is not None
    assert flight.result is not None
    assert flight.result.title == "The path is flown"
    assert flight.result.score == flown.score
    assert observer.heard == ["patient", "start", "moment of frame 0"]
    assert [f.number for f in observer.frames] == list(range(len(observer.frames)))
    # who looks on hears all of it, too
    assert (beside.heard, beside.view) == (observer.heard, observer.view)
    assert beside.frames == observer.frames
    assert load_view(Path(observer.view)).to_camera().key == (
        observer.frames[0].view.camera.key
    )
    # the replay knows which scope was in hand when
    assert {f.view.scope_deg for f in observer.frames} == {0.0, 30.0}
    report = replay_session(record, threads=1, progress=lambda stage, share: None)
    assert report.is_exact
    assert report.score == flown.score
    assert report.frames == len(observer.frames) == len(flown.timing.frame_ms)
    records = read_session(record)[1]
    (event,) = (r for r in records if isinstance(r, EventRecord))
    assert (event.kind, event.text) == ("snapshot", "frame 0")


@pytest.mark.parametrize(
    "far_mm", [-3.697e28, pytest.param(1e6, marks=pytest.mark.slow)]
)
def test_poses_beyond_any_hand_are_left_out_told_and_the_flight_goes_on(
    never_behind: None, far_mm: float, short_scenario: Path, tmp_path: Path
) -> None:
    """A word for "missing" in the middle, for half a second, and at the end."""
    scenario, folder = load_scenario(str(short_scenario))
    whole = load_probe_path(folder / scenario.path)
    tips, tools = whole.tip_mm.copy(), whole.instrument_tip_mm.copy()
    missing = np.zeros(len(tips), bool)
    missing[[20, -1]] = missing[80:130] = True
    tips[missing, 0] = far_mm
    tools[40:42, 2] = far_mm
    path = replace(whole, tip_mm=tips, instrument_tip_mm=tools)
    path_file = tmp_path / "missing.path.json"
    save_probe_path(path, path_file)
    played = choose_input(f"recording:{path_file}", None, scenario, path, path_file)
    record = tmp_path / "flight.paravol"
    flight = Flight(FlightOrder(scenario, path, played, SIZE, 1, record), Kept().hear)
    flown = flight.run()
    assert flown is not None
    assert flight.result is not None
    assert flight.result.title == "The path is flown"
    records = read_session(record)[1]
    flown_s = {r.time_s for r in records if isinstance(r, SampleRecord)}
    assert flown_s == set(whole.t_s[~missing])
    told = [r.text for r in records if isinstance(r, EventRecord)]
    lost, back, count = (text for text in told if "frame" not in text)
    assert "out of reach" in lost
    assert back == "The device is back after 0.5 s."
    assert count.startswith(f"{missing.sum()} poses lay beyond any hand's reach")
    report = replay_session(record, threads=1, progress=lambda stage, share: None)
    assert report.is_exact
    assert report.score == flown.score


def first_bite(folder: Path) -> Path:
    """Write two seconds of the bundled operation: tissue is pushed and bitten."""
    scenario, bundled = load_scenario("first_operation")
    whole = load_probe_path(bundled / scenario.path)
    tools = ((0.0, "straight forceps"),)
    cut = part_of(whole, "bite", 15.0, 17.0, tools=tools)
    save_probe_path(cut, folder / "bite.path.json")
    text = (bundled / "first_operation.toml").read_text().split("[[moments]]")[0]
    for old, new in (
        ("first_operation.path.json", "bite.path.json"),
        ("spacing_mm = 0.5", "spacing_mm = 1.0"),
    ):
        assert old in text
        text = text.replace(old, new)
    (folder / "bite.toml").write_text(text)
    return folder / "bite.toml"


class Biting(Kept):
    """Takes the forceps, and closes them for half a second."""

    def hear(self, event: events.FlightEvent) -> None:
        super().hear(event)
        if isinstance(event, FrameEvent):
            assert self.flight is not None
            self.flight.hand.choose("straight forceps")
            self.flight.hand.work(1.0 <= event.sample.time_s < 1.6)


def test_a_replay_bends_and_cuts_tissue_as_the_flight_did(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bends: list[tuple[int, int, int]] = []
    show = Pushing.show

    def noted(
        self: Pushing, generation: int, kind: ChangeKind = ChangeKind.DENT
    ) -> Change | None:
        change = show(self, generation, kind)
        values = self.surface.distance.values
        if change is not None:
            bends.append((values.size, generation, zlib.crc32(values.tobytes())))
        return change

    monkeypatch.setattr(Pushing, "show", noted)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(keyframes, "APART_S", 0.4)
    scenario, path, played = played_scenario(first_bite(tmp_path))
    record, observer = tmp_path / "flight.paravol", Biting()
    flight = Flight(FlightOrder(scenario, path, played, SIZE, 1, record), observer.hear)
    observer.flight = flight
    assert flight.run() is not None
    # before it, a piece of the head was rehearsed on
    flown = [seen for seen in bends if seen[0] == bends[-1][0]]
    bends.clear()
    assert len(flown) > 3
    report = replay_session(record, threads=1, progress=lambda stage, share: None)
    assert report.is_exact
    assert report.frames == len(observer.frames)
    assert bends == flown
    edits = sum(isinstance(r, EditRecord) for r in read_session(record)[1])
    # dents are no cuts
    assert edits >= observer.frames[-1].cuts > 0
    # its own keyframes lead to what stepping from the beginning leads to
    for thread in threading.enumerate():
        if thread.name == "keyframes":
            thread.join()
    head = load_patient(scenario, lambda stage, share: None)
    known = load_keyframes(record, head)
    assert known.until_s > observer.frames[-1].sample.time_s - 0.4
    stepped = SessionTimeline(record, head)
    state = end_of(stepped)
    for keyframe in known.kept:
        near = SessionTimeline(record, head, keyframes=Keyframes([keyframe]))
        assert end_of(near) == state
        assert near.steps == stepped.steps - 1 - keyframe.place


def end_of(timeline: SessionTimeline) -> tuple[str, int, str, Score]:
    """Go to a session's end; return what was done to the patient, and the score."""
    timeline.go_to(timeline.end_s)
    operation = timeline.session.operation
    assert operation is not None
    bent = zlib.crc32(operation.pushing.surface.distance.values.tobytes())
    return operation.patient.hash(), bent, operation.film.hash(), timeline.score()


def test_a_flight_that_is_cancelled_before_leaves_nothing(tmp_path: Path) -> None:
    scenario, _ = load_scenario("first_flight")
    record = tmp_path / "flight.paravol"
    flight = Flight(flight_order(scenario, record), lambda event: None)
    flight.cancel()
    assert flight.run() is None
    assert flight.result is None
    assert not record.exists()
