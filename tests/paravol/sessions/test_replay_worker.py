"""A replay shows what was wanted last, to the bit what was seen in flight."""

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
import pytest

from paravol.patient import PatientScene
from paravol.sessions import replay_worker
from paravol.sessions.free_camera import CameraMove
from paravol.sessions.replay_events import (
    Measured,
    NotesChanged,
    OpenedReplay,
    ReplayEvent,
    ReplayFailed,
    ReplayOrder,
    Seeking,
    ShownReplay,
    Told,
    Unmeasured,
)
from paravol.sessions.replay_worker import ReplayWorker
from paravol.sessions.session_timeline import SessionTimeline
from paravol.sessions.time_marks import MarkKind
from scenarios import Scenario, load_scenario
from scenarios.bundle import FrameRecord, Note, read_notes, read_recording, write_json
from system import UserError
from tests.paravol.operated_head import head_round_an_orbit
from tests.paravol.sessions.flown_session import (
    EVERY_S,
    LASTS_S,
    SHOWN_EVERY,
    Doubles,
    record_flight,
)

SIZE = 32

_E = TypeVar("_E", bound=ReplayEvent)


class Heard:
    """Keep what is told."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.told: list[ReplayEvent] = []

    def hear(self, event: ReplayEvent) -> None:
        with self.changed:
            self.told.append(event)
            self.changed.notify_all()

    def all(self, kind: type[_E]) -> list[_E]:
        return [event for event in self.told if isinstance(event, kind)]

    @property
    def shown(self) -> list[ShownReplay]:
        return self.all(ShownReplay)

    @property
    def opened(self) -> OpenedReplay:
        (opened,) = self.all(OpenedReplay)
        return opened

    def until(self, holds: Callable[[], object]) -> None:
        with self.changed:
            assert self.changed.wait_for(holds, 60.0), self.told


def straight(
    patient: PatientScene,
) -> Callable[[float], tuple[Doubles, Doubles, Doubles, Doubles]]:
    centre = patient.scene.volume.center_mm
    way = np.array([0.0, 1.0, 0.2]) / np.hypot(1.0, 0.2)

    def poses(share: float) -> tuple[Doubles, Doubles, Doubles, Doubles]:
        tip = centre + way * (3.0 * share - 2.0)
        return tip, way, tip + 1.5 * way, way

    return poses


@pytest.fixture(scope="module")
def patient() -> PatientScene:
    return head_round_an_orbit(load_scenario("first_flight")[0])


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory, patient: PatientScene) -> Path:
    folder = tmp_path_factory.mktemp("flown") / "slow.paravol"
    scenario, _ = load_scenario("first_flight")
    return record_flight(folder, scenario, patient, straight(patient), size=SIZE)


@pytest.fixture(scope="module")
def fast(tmp_path_factory: pytest.TempPathFactory, patient: PatientScene) -> Path:
    folder = tmp_path_factory.mktemp("flown") / "fast.paravol"
    scenario, _ = load_scenario("first_flight")
    poses = straight(patient)
    return record_flight(folder, scenario, patient, poses, speed=2.0, size=SIZE)


@pytest.fixture
def unmeasured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measuring takes seconds that a test of pictures need not wait for."""

    def refuse(*words: object, **named: object) -> None:
        raise UserError("Nothing is measured here.")

    monkeypatch.setattr(replay_worker, "gather", refuse)


@pytest.fixture
def begun(
    slow: Path, patient: PatientScene
) -> Iterator[Callable[..., tuple[ReplayWorker, Heard]]]:
    workers: list[ReplayWorker] = []

    def begin(
        folder: Path = slow, beside: Path | None = None
    ) -> tuple[ReplayWorker, Heard]:
        heard = Heard()
        order = ReplayOrder(folder, beside, patient=patient, threads=1)
        worker = ReplayWorker(order, heard.hear)
        workers.append(worker)
        worker.start()
        return worker, heard

    yield begin
    for worker in workers:
        assert worker.stop(30.0)


Begun = Callable[..., tuple[ReplayWorker, Heard]]


def shown_at(worker: ReplayWorker, heard: Heard, time_s: float) -> ShownReplay:
    jump = worker.jump_to(time_s)
    heard.until(lambda: heard.shown and heard.shown[-1].jump == jump)
    return heard.shown[-1]


@pytest.mark.usefixtures("unmeasured")
def test_any_moment_has_the_bits_of_the_flight(begun: Begun, slow: Path) -> None:
    worker, heard = begun()
    records = read_recording(slow).records
    frames = [r for r in records if isinstance(r, FrameRecord)]
    for number in (7, 2, 10, 0):
        shown = shown_at(worker, heard, SHOWN_EVERY * EVERY_S * number)
        assert shown.here.is_recorded is True
        assert shown.here.frame.fingerprint() == frames[number].xxh3_128
    # a sample that no frame has shown is compared with none
    assert shown_at(worker, heard, EVERY_S).here.is_recorded is None
    assert heard.opened.frame_times_s == pytest.approx(
        [SHOWN_EVERY * EVERY_S * n for n in range(len(frames))]
    )


@pytest.mark.usefixtures("unmeasured")
def test_a_newer_wish_overtakes_a_long_way(
    begun: Begun, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = SessionTimeline._step
    is_slow = threading.Event()
    is_slow.set()

    def slowly(timeline: SessionTimeline) -> None:
        if is_slow.is_set():
            time.sleep(0.05)
        step(timeline)

    monkeypatch.setattr(SessionTimeline, "_step", slowly)
    worker, heard = begun()
    shown_at(worker, heard, 0.0)
    worker.jump_to(LASTS_S)
    heard.until(lambda: heard.all(Seeking))
    is_slow.clear()
    shown = shown_at(worker, heard, 0.2)
    assert shown.here.sample.time_s == pytest.approx(0.2)
    assert shown.here.is_recorded is True
    shares = [seeking.share for seeking in heard.all(Seeking)]
    assert shares == sorted(shares)
    assert max(shares) < 1.0
    # the way that was given up has shown nothing
    assert [s.jump for s in heard.shown] == [1, 3]


@pytest.mark.usefixtures("unmeasured")
def test_another_camera_looks_on_and_the_way_back_is_exact(begun: Begun) -> None:
    worker, heard = begun()
    before = shown_at(worker, heard, 1.0).here.frame.pixels
    worker.leave_view(True)
    worker.look(CameraMove(right_deg=25.0, ahead_mm=-2.0))
    heard.until(lambda: heard.shown[-1].is_free)
    worker.look(CameraMove(up_deg=10.0))
    count = len(heard.shown)
    heard.until(lambda: len(heard.shown) > count)
    own = heard.shown[-1].here
    assert own.is_recorded is None
    assert not np.array_equal(own.frame.pixels, before)
    # whoever rests and looks again sees no other exposure
    gain = own.frame.gain
    shown = shown_at(worker, heard, 1.0 + EVERY_S)
    worker.jump_to(1.0)
    heard.until(lambda: heard.shown[-1].jump == shown.jump + 1)
    assert heard.shown[-1].here.frame.gain == pytest.approx(gain, rel=1e-6)
    worker.leave_view(False)
    heard.until(lambda: not heard.shown[-1].is_free)
    assert np.array_equal(heard.shown[-1].here.frame.pixels, before)
    assert heard.shown[-1].here.is_recorded is True


@pytest.mark.usefixtures("unmeasured")
def test_two_sessions_are_tied_by_landmarks_or_by_time(
    begun: Begun, slow: Path, fast: Path
) -> None:
    worker, heard = begun(slow, fast)
    for by_landmarks, other_s in ((True, 0.2), (False, 0.4)):
        worker.align_by(landmarks=by_landmarks)
        shown = shown_at(worker, heard, 0.4)
        assert shown.there is not None
        assert shown.there.sample.time_s == pytest.approx(other_s, abs=EVERY_S)


@pytest.mark.slow
def test_the_other_sessions_figures_stand_beside(
    begun: Begun, slow: Path, fast: Path
) -> None:
    worker, heard = begun(slow, fast)
    shown_at(worker, heard, 0.0)
    heard.until(lambda: heard.all(Measured) or heard.all(Unmeasured))
    (measured,) = heard.all(Measured)
    assert any(mark.kind is MarkKind.TOOL for mark in measured.marks)
    own, other = next(r[1:] for r in measured.rows if r[0] == "scope: task time")
    assert (own, other) == ("2 s", "1 s")


@pytest.mark.usefixtures("unmeasured")
def test_notes_are_written_and_removed(begun: Begun, slow: Path) -> None:
    worker, heard = begun()
    shown_at(worker, heard, 0.0)
    worker.note(1.25, "Hold still here")
    heard.until(lambda: heard.all(NotesChanged))
    (changed,) = heard.all(NotesChanged)
    assert read_notes(slow) == changed.notes == (Note(1.25, "Hold still here"),)
    worker.remove_note(2)
    heard.until(lambda: heard.all(Told))
    assert "no number 2" in heard.all(Told)[-1].detail
    worker.remove_note(1)
    heard.until(lambda: len(heard.all(NotesChanged)) == 2)
    assert read_notes(slow) == ()


def without_its_description(folder: Path) -> None:
    (folder / "session.json").unlink()


def of_a_later_version(folder: Path) -> None:
    file = folder / "session.json"
    file.write_text(file.read_text().replace("{", '{"from_the_future": 1, ', 1))


def with_another_stream(folder: Path) -> None:
    (folder / "stream.mcap").write_bytes(b"not a stream at all")


def of_a_case_elsewhere(folder: Path) -> None:
    info = read_recording(folder).info
    scenario = msgspec.json.decode(info.scenario, type=Scenario)
    head = msgspec.structs.replace(scenario.head, case="nowhere/at/all")
    elsewhere = msgspec.json.encode(msgspec.structs.replace(scenario, head=head))
    changed = msgspec.structs.replace(info, scenario=elsewhere.decode())
    write_json(folder / "session.json", changed)


@pytest.mark.parametrize(
    ("spoil", "words", "lacks_case"),
    [
        (without_its_description, "is not a session", False),
        (of_a_later_version, "from_the_future", False),
        (with_another_stream, "is not an MCAP stream", False),
        (of_a_case_elsewhere, "which is not there", True),
    ],
)
def test_what_cannot_be_shown_is_refused_in_a_sentence(
    begun: Begun,
    slow: Path,
    tmp_path: Path,
    spoil: Callable[[Path], None],
    words: str,
    lacks_case: bool,
) -> None:
    folder = tmp_path / "spoilt.paravol"
    shutil.copytree(slow, folder)
    spoil(folder)
    _, heard = begun(folder)
    heard.until(lambda: heard.all(ReplayFailed))
    (failed,) = heard.all(ReplayFailed)
    assert isinstance(failed.error, UserError)
    assert words in str(failed.error)
    assert failed.lacks_case == lacks_case


@pytest.mark.usefixtures("unmeasured")
def test_a_half_written_recording_is_shown_as_far_as_it_goes(
    begun: Begun, slow: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "half.paravol"
    shutil.copytree(slow, folder)
    (folder / "result.json").unlink()
    stream = folder / "stream.mcap"
    stream.write_bytes(stream.read_bytes()[:-400])
    worker, heard = begun(folder)
    assert shown_at(worker, heard, 0.4).here.is_recorded is True
    assert not heard.opened.is_complete
