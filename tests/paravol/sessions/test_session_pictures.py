"""Films of a session: at a speed, by another camera, beside another session."""

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from app.cli.replay_command import replay
from app.cli.replay_options import ReplayOptions
from paravol.patient import PatientScene, no_progress
from paravol.sessions import session_pictures
from paravol.sessions.session_pictures import (
    FILM_FPS,
    GAP_PX,
    SessionPictures,
    SideBySide,
    film_session,
)
from paravol.sessions.session_timeline import SessionTimeline
from paravol.snapshots.view_file import ViewCamera
from scenarios import Sample, load_scenario, tip_frame
from scenarios.bundle import SampleRecord, read_recording
from system import UserError
from tests.recorded_flight import info_of, write_records
from tests.scenes import make_scene

SIZE = 32
EVERY_S = 0.1


@dataclass
class Flights:
    """Two flights along the same way, one twice as fast."""

    slow: Path
    fast: Path
    patient: PatientScene

    def pictures(
        self, folder: Path, camera: ViewCamera | None = None
    ) -> SessionPictures:
        return SessionPictures(
            folder, progress=no_progress, camera=camera, threads=1, patient=self.patient
        )


@pytest.fixture(scope="module")
def flights(tmp_path_factory: pytest.TempPathFactory) -> Flights:
    scene = make_scene()
    scenario, _ = load_scenario("first_flight")
    centre = scene.volume.center_mm
    landmarks = {"midway": centre, **dict.fromkeys(scenario.targets, centre + 0.5)}
    patient = PatientScene(scene, landmarks, "a" * 64)
    way = np.array([0.0, 1.0, 0.2]) / np.hypot(1.0, 0.2)
    folders = []
    for name, speed in (("slow", 1.0), ("fast", 2.0)):
        records = []
        for i in range(round(4.0 / speed / EVERY_S) + 1):
            tip = centre + way * (speed * i * EVERY_S - 2.0)
            sample = Sample(i * EVERY_S, tip_frame(tip, way), 0.0, tip, way, 0)
            records.append(SampleRecord.of(sample))
        folder = tmp_path_factory.mktemp("flown") / f"{name}.paravol"
        folders.append(write_records(folder, info_of(scenario, patient), records))
    slow, fast = folders
    return Flights(slow, fast, patient)


@pytest.mark.parametrize("operated", [False, True])
def test_a_clock_that_ran_backwards_stands(
    flights: Flights, tmp_path: Path, operated: bool
) -> None:
    """Every sample is stepped once, and the score's clock never goes back."""
    found = read_recording(flights.slow)
    info = msgspec.structs.replace(found.info, operated=operated)
    samples = [r for r in found.records if isinstance(r, SampleRecord)][:20]
    times = [0.0, 0.1, 0.2, 9.0, -4.0, 0.3, *np.linspace(8.5, 9.8, 14).tolist()]
    moved = [
        msgspec.structs.replace(record, time_s=time_s)
        for record, time_s in zip(samples, times, strict=True)
    ]
    folder = write_records(tmp_path / "back.paravol", info, moved)
    timeline = SessionTimeline(folder, flights.patient)
    assert (timeline.begin_s, timeline.end_s) == (0.0, max(times))
    clock_s = 0.0
    for time_s in (0.0, 0.25, 5.0, 9.0, 9.5, timeline.end_s):
        sample, _ = timeline.go_to(time_s)
        assert sample.time_s <= time_s
        assert timeline.session.clock_s >= clock_s
        clock_s = timeline.session.clock_s
    assert timeline.steps == len(times)


@dataclass
class Counted:
    """Count what a film would show; each picture is its own time."""

    size: tuple[int, int]
    shown_s: list[float]

    def at(self, time_s: float) -> NDArray[np.uint8]:
        self.shown_s.append(time_s)
        return np.zeros((self.size[1], self.size[0], 3), np.uint8)


@pytest.mark.parametrize("speed", [0.25, 0.5, 1.0, 3.0])
def test_a_film_shows_each_moment_when_it_is_due(tmp_path: Path, speed: float) -> None:
    counted = Counted((SIZE, SIZE), [])
    lasts_s = film_session(
        tmp_path / "a.mp4", counted, (1.0, 3.0), speed=speed, progress=no_progress
    )
    assert abs(lasts_s - 2.0 / speed) <= 2.0 / FILM_FPS
    due = 1.0 + speed * np.arange(len(counted.shown_s)) / FILM_FPS
    assert np.allclose(counted.shown_s, np.minimum(due, 3.0), atol=1e-6)
    assert counted.shown_s[-1] == 3.0


def test_a_camera_of_ones_own_stands_still(flights: Flights) -> None:
    """The picture is the same while only the scope moves, for it is not in it."""
    eye = flights.patient.landmarks["midway"]
    target = eye + np.array([5.0, 0.0, 9.0])
    own = ViewCamera(tuple(eye.tolist()), 1.0, target_mm=tuple(target.tolist()))
    ours = flights.pictures(flights.slow, own)
    ours.at(1.0)
    assert ours._camera is not None
    assert np.array_equal(ours._camera.eye_mm, eye)
    theirs = flights.pictures(flights.slow)
    assert not np.array_equal(theirs.at(1.0), ours.at(1.0))


def test_two_sessions_meet_at_what_both_reached(flights: Flights) -> None:
    slow, fast = flights.pictures(flights.slow), flights.pictures(flights.fast)
    both = SideBySide(slow, fast)
    assert "midway" in both.times.names
    assert both.times.at(2.0) == pytest.approx(1.0)
    sheet = both.at(2.0)
    assert sheet.shape == (SIZE, 2 * SIZE + GAP_PX, 3)
    # below the times that are written on them, both show the same
    left, right = sheet[20:, :SIZE], sheet[20:, SIZE + GAP_PX :]
    assert np.array_equal(left, slow.at(2.0)[20:])
    assert np.array_equal(right, fast.at(1.0)[20:])
    assert np.array_equal(left, right)


def test_the_command_films_two_together(
    flights: Flights,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(
        session_pictures, "load_patient", lambda *words: flights.patient
    )
    monkeypatch.setenv("COLUMNS", "160")
    film = tmp_path / "both.mp4"
    options = ReplayOptions(
        video=film, speed=10.0, from_s=1.5, to_s=3.0, beside=flights.fast, threads=1
    )
    assert replay(flights.slow, options=options) == 0
    assert film.stat().st_size > 500
    said = capsys.readouterr().out
    assert "midway" in said
    assert "1.5 to 3.0 s at 10 times" in said
    with pytest.raises(UserError, match=r"lasts from 0\.0 to 4\.0 s"):
        replay(flights.slow, options=ReplayOptions(video=film, to_s=9.0))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (ReplayOptions(speed=2.0), "--speed goes with --video"),
        (ReplayOptions(from_s=2.0), "--from goes with --video"),
        (ReplayOptions(beside=Path("b")), "--beside goes with --video"),
        (ReplayOptions(at=1.0, camera=Path("b")), "--camera goes with --video"),
        (ReplayOptions(video=Path("a.mp4"), speed=20.0), "0.1 to 10 times"),
        (ReplayOptions(picture=Path("a.png")), "--picture goes with --at"),
        (ReplayOptions(at=1.0, check=True), "--at goes without"),
        (ReplayOptions(view_at=1.0), "--view-at and --out"),
        (ReplayOptions(out=Path("a")), "--view-at and --out"),
        (ReplayOptions(case=Path("b")), "--case goes with"),
        (ReplayOptions(view_at=-1.0, out=Path("a")), "got -1"),
        (ReplayOptions(video=Path("a.mp4"), speed=2.0, check=True), "--check compares"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    options: ReplayOptions, words: str
) -> None:
    with pytest.raises(UserError, match=words):
        replay(Path("nowhere"), options=options)
