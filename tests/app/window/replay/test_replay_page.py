"""The replay page in the real window: sessions are dropped, scrubbed and compared."""

from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication

from app.window.home.home_page import HomePage
from app.window.replay.replay_page import ReplayPage
from paravol.patient import load_patient, no_progress
from scenarios import load_scenario
from tests.app.window.desk_run import opened_desk, until
from tests.app.window.opened_window import run_script
from tests.paravol.sessions.flown_session import along_the_path, record_flight
from tests.paravol.trainee import hoops_flight

REPLAY = """
import sys, time
from pathlib import Path
from PySide6.QtCore import QEventLoop, QMimeData, QPoint, QPointF, Qt, QTimer, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment

prepare_environment()
from app.window.main_window import MainWindow
from app.window.panels.qt_image import image_of
from app.window.replay.replay_page import ReplayPage
from scenarios.bundle import FrameRecord, read_notes, read_recording

slow, fast, bad = map(Path, sys.argv[1:])
application = QApplication([])
window, page = MainWindow(), ReplayPage()
Key, Button = Qt.Key, Qt.MouseButton
window.dropped.connect(page.open)
window.show_page(page)
window.show()

def until(holds, limit_s=100.0):
    began = time.monotonic()
    while not holds():
        assert time.monotonic() - began < limit_s, page.problem.text()
        loop = QEventLoop()
        QTimer.singleShot(10, loop.quit)
        loop.exec()

def drop(*paths):
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
    none, copy = Qt.KeyboardModifier.NoModifier, Qt.DropAction.CopyAction
    entered = QDragEnterEvent(QPoint(99, 99), copy, data, Button.LeftButton, none)
    application.sendEvent(window, entered)
    assert entered.isAccepted()
    dropped = QDropEvent(QPointF(99, 99), copy, data, Button.LeftButton, none)
    application.sendEvent(window, dropped)

def settled():
    return page._seen is not None and page._seen.jump == page._jump

def pixels():
    return page._seen.here.frame.pixels

frames = [r for r in read_recording(slow).records if isinstance(r, FrameRecord)]
drop(slow)
until(lambda: page._opened is not None and settled())
times = page._opened.frame_times_s
for number in (8, 3, 5):
    at = QPointF(page.line.x_of(times[number]), page.line.height() - 2.0).toPoint()
    QTest.mouseClick(page.line, Button.LeftButton, pos=at)
    QTest.keyClick(page, Key.Key_Left)
    QTest.keyClick(page, Key.Key_Right)
    until(settled)
    shown = page._seen.here
    assert shown.frame.fingerprint() == frames[shown.recorded.number].xxh3_128
    assert shown.is_recorded and abs(shown.recorded.number - number) <= 1
    assert "the same bits" in page.transport.state.text()
    assert page.picture._image == image_of(shown.frame.pixels)
    before = shown.recorded.number
    QTest.keyClick(page, Key.Key_Right)
    until(settled)
    assert page._seen.here.recorded.number == before + 1 and page._seen.here.is_recorded

# at twice the speed, from the begin to the end
QTest.keyClick(page, Key.Key_Home)
QTest.keyClick(page, Key.Key_Up)
until(settled)
assert page._player.speed == 2.0
QTest.keyClick(page, Key.Key_Space)
assert page._player.is_playing
until(lambda: not page._player.is_playing)
until(lambda: page._seen.here.sample.time_s == page._opened.end_s)

# to what happened: back from the end to the change of the tool
QTest.keyClick(page, Key.Key_PageUp)
until(settled)
assert abs(page._seen.here.sample.time_s - 1.0) < 1e-6

# away from the recorded view, and back to the same bits
recorded = pixels().copy()
QTest.mousePress(page.picture, Button.LeftButton, pos=QPoint(100, 100))
QTest.mouseMove(page.picture, QPoint(180, 130))
QTest.mouseRelease(page.picture, Button.LeftButton, pos=QPoint(180, 130))
QTest.keyClick(page, Key.Key_S)
until(lambda: page._seen.is_free and (pixels() != recorded).mean() > 0.05)
QTest.keyClick(page, Key.Key_V)
until(lambda: not page._seen.is_free)
assert (pixels() == recorded).all()

# a note about this moment, read and removed again
QTest.keyClick(page, Key.Key_N)
QTest.keyClicks(page._side.book.line, "Watch the tip")
QTest.keyClick(page._side.book.line, Key.Key_Return)
until(lambda: [n.text for n in read_notes(slow)] == ["Watch the tip"])
until(lambda: page._side.book.notes.count() == 1)
page._side.book.notes.setCurrentRow(0)
page._side.book.remove.click()
until(lambda: not read_notes(slow) and not page._side.book.notes.count())

# what is no session changes nothing of what is shown
drop(bad)
until(lambda: page.problem.isVisible())
assert "is not a session" in page.problem.text()
assert (pixels() == recorded).all() and page._opened.order.folder == slow
QTest.keyClick(page, Key.Key_Left)
until(settled)

# two together, by landmarks and by time
drop(slow, fast)
until(lambda: page._opened.order.beside == fast and page._seen and page._seen.there)
assert not page.problem.isVisible() and page._halves[1].isVisible()
page.seek(0.8)
until(lambda: settled() and abs(page._seen.here.sample.time_s - 0.8) < 1e-6)
QTest.keyClick(page, Key.Key_L)
until(lambda: abs(page._seen.there.sample.time_s - 0.8) < 1e-6)
assert page._side.metrics.topLevelItemCount() or page._side.metrics.columnCount()
window.shut()
window.release()
assert not any(ending.is_alive() for ending in page._endings)
"""

LEFT = """
import sys, threading
from pathlib import Path
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment

prepare_environment()
application = QApplication([])
from app.window.home.home_page import HomePage
from app.window.replay.replay_page import ReplayPage
from paravol.sessions.session_pictures import SessionPictures
from paravol.trainee.choices import ChoiceFile, Choices
from scenarios.bundle import read_notes
from tests.app.window.desk_run import opened_desk, until, waits_of_the_window

folder, flown = map(Path, sys.argv[1:])
ChoiceFile(folder / "trainee.json").save(Choices(tours=("home", "flight")))
desk = opened_desk(folder)
window, Left = desk._window, Qt.MouseButton.LeftButton
is_held, may_go_on = threading.Event(), threading.Event()
moment = SessionPictures.moment
def held(pictures, *words):
    is_held.set()
    assert may_go_on.wait(60.0)
    return moment(pictures, *words)
SessionPictures.moment = held
waits = waits_of_the_window(may_go_on.set)
gone = []

def replay(note):
    # from home, by mouse and keys; a note is written while the first picture is drawn
    is_held.clear(), may_go_on.clear()
    QTest.mouseClick(window.page.bar.recordings, Left)
    page = window.page
    assert isinstance(page, ReplayPage)
    until("a flight", lambda: page.welcome.recent.currentItem() is not None)
    QTest.keyClick(page.welcome.recent, Qt.Key.Key_Return)
    until("a session", lambda: page._opened is not None)
    # a lambda is called in the thread that the object ends in
    page._thread.destroyed.connect(lambda: gone.append(threading.current_thread()))
    until("a picture under way", is_held.is_set)
    QTest.keyClick(page, Qt.Key.Key_N)
    QTest.keyClicks(page._side.book.line, note)
    QTest.keyClick(page._side.book.line, Qt.Key.Key_Return)
    return page

window.show()
desk.open_home()
page = replay("seen by nobody yet")
QTest.mouseClick(page.transport.leave, Left)
assert isinstance(window.page, HomePage)
assert (waits, may_go_on.is_set()) == ([], False)
may_go_on.set()
until("an end", lambda: gone)
assert gone == [threading.main_thread()]
replay("the last one")
window.shut()
desk.close()
assert (waits, may_go_on.is_set()) == ([], False)
window.release()
# the program's end waits
assert waits
assert not [t for t in threading.enumerate() if t.name in ("replay", "measuring")]
print([note.text for note in read_notes(flown)])
"""


@pytest.mark.display
def test_who_leaves_a_replay_waits_for_nothing_and_loses_nothing(
    screen: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    (tmp_path / "sessions").mkdir()
    flown = hoops_flight.record(tmp_path / "sessions" / "a.paravol")
    told = run_script(LEFT, tmp_path, flown)
    assert told == "['seen by nobody yet', 'the last one']\n"


@pytest.mark.display
@pytest.mark.slow
def test_a_dropped_session_is_scrubbed_left_annotated_and_compared(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    scenario, _ = load_scenario(str(coarse_scenario))
    patient = load_patient(scenario, no_progress)
    poses = along_the_path(coarse_scenario)
    slow, fast = tmp_path / "slow.paravol", tmp_path / "fast.paravol"
    record_flight(slow, scenario, patient, poses)
    record_flight(fast, scenario, patient, poses, speed=2.0)
    bad = tmp_path / "bad.paravol"
    bad.mkdir()
    run_script(REPLAY, slow, fast, bad)


def test_what_is_dropped_on_home_is_replayed_or_refused_there(
    application: QApplication, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    desk = opened_desk(tmp_path)
    window = desk._window
    desk.open_home()
    window.dropped.emit([tmp_path / "nothing.paravol"])
    page = window.page
    assert isinstance(page, ReplayPage)
    until("a refusal", lambda: page.problem.text())
    assert "nothing.paravol is not a session" in page.problem.text()
    page.left.emit()
    assert isinstance(window.page, HomePage)
    desk.close()
    window.shut()
    window.release()
