"""The way through the window: home, flight, result, and what cannot be flown."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.home.home_page import HomePage
from app.window.navigator import Navigator
from paravol.exercises.training_setup import DeviceSetup
from paravol.sessions.session_store import SessionStore
from paravol.sessions.unfinished_sessions import unfinished_sessions
from paravol.trainee.choices import ChoiceFile, Choices
from tests.app.window.desk_run import delete, opened_desk, until
from tests.app.window.opened_window import run_script
from tests.paravol.trainee import hoops_flight


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    choices = Choices(tours=("home", "flight"))
    ChoiceFile(tmp_path / "trainee.json").save(choices)
    return tmp_path


@pytest.fixture
def desk(application: QApplication, folder: Path) -> Iterator[Navigator]:
    desk = opened_desk(folder)
    desk.open_home()
    yield desk
    desk.close()
    shut(desk)


def shut(desk: Navigator) -> None:
    until("all is read", lambda: not desk._works)
    desk._window.shut()
    desk._window.release()
    delete(desk._window)


def home(desk: Navigator) -> HomePage:
    page = desk._window.page
    assert isinstance(page, HomePage)
    return page


def filled(desk: Navigator) -> HomePage:
    page = home(desk)
    until("a ladder", lambda: page.go_on.text())
    return page


def test_a_locked_exercise_is_not_flown_but_told(desk: Navigator) -> None:
    page = filled(desk)
    desk.fly("uncinectomy")
    assert "locked: first pass Injection" in page.problem.text()
    assert desk._window.page is page
    assert desk.flown == []
    page.list.select("uncinectomy")
    assert not page.card.start.isEnabled()
    assert "Injection" in page.card.findChildren(type(page.problem))[3].text()
    page.list.setFocus()
    QTest.keyClick(page.list, Qt.Key.Key_Return)
    until("all is read", lambda: not desk._works)
    assert desk._window.page is page


def test_what_cannot_be_flown_is_told_at_home(
    application: QApplication, folder: Path
) -> None:
    desk = opened_desk(folder, DeviceSetup(scope="gamepad:/no/such/event0"))
    desk.open_home()
    page = filled(desk)
    assert page.bar.device.currentText().startswith("gamepad:/no/such/event0")
    QTest.keyClick(page.go_on, Qt.Key.Key_Return)
    until("a problem", lambda: page.problem.text())
    assert "/no/such/event0" in page.problem.text()
    assert page.go_on.isEnabled()
    assert (desk._window.page, desk.flown, desk.error) == (page, [], None)
    desk.close()
    shut(desk)


def test_a_folder_that_is_no_case_is_told_and_not_remembered(
    desk: Navigator, folder: Path
) -> None:
    page = filled(desk)
    desk.fly_case(folder / "nothing")
    until("a problem", lambda: page.problem.text())
    assert "nothing" in page.problem.text()
    assert ChoiceFile(folder / "trainee.json").load().cases == ()


def test_a_store_that_cannot_be_read_is_told_and_one_can_train(
    application: QApplication, folder: Path
) -> None:
    (folder / "progress.sqlite").write_text("no store")
    desk = opened_desk(folder)
    desk.open_home()
    page = filled(desk)
    assert "progress.sqlite" in page.problem.text()
    assert page.go_on.isEnabled()
    assert page.go_on.text() == "Begin: Centring"
    desk.close()
    shut(desk)


def test_a_name_is_remembered_and_one_that_tells_too_much_is_refused(
    desk: Navigator, folder: Path
) -> None:
    page = filled(desk)
    page.bar.trainee.setEditText("ann")
    page.bar._on_name()
    assert ChoiceFile(folder / "trainee.json").load().trainee == "ann"
    page.bar.trainee.setEditText("ann@example.org")
    page.bar._on_name()
    assert "ann@example.org" in page.problem.text()
    assert page.bar.trainee.currentText() == "ann"


def test_flights_that_were_cut_off_are_offered_kept_or_discarded(
    application: QApplication, folder: Path
) -> None:
    sessions = SessionStore(folder / "sessions")
    sessions.folder.mkdir()
    for day in (1, 2):
        hoops_flight.record(
            sessions.folder / f"{day}.paravol",
            created=f"2026-03-0{day}T10:00:00+00:00",
            has_end=False,
        )
    desk = opened_desk(folder)
    desk.open_home()
    page = home(desk)
    until("an offer", lambda: page.recovery._left)
    assert not page.recovery.isHidden()
    assert "2026-03-02 10:00" in page.recovery._text.text()
    page.recovery.discard.click()
    assert "2026-03-01" in page.recovery._text.text()
    until("one is gone", lambda: len(unfinished_sessions(sessions)) == 1)
    page.recovery.keep.click()
    assert page.recovery.isHidden()
    assert (sessions.folder / "1.paravol").is_dir()
    desk.open_home()
    page = filled(desk)
    desk.close()
    until("all is read", lambda: not desk._works)
    assert page.recovery.isHidden()
    shut(desk)


WINDOW = """
import sys, time
from functools import partial
from pathlib import Path
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment

prepare_environment()
application = QApplication([])
from app.window.flight.ended_page import EndedPage
from app.window.flight.flight_page import FlightPage
from app.window.home.home_page import HomePage
from app.window.settings_dialog import SettingsDialog
from system import UserError
from paravol.flight import flight
from paravol.trainee.choices import ChoiceFile, Choices
from tests.app.window.desk_run import opened_desk, until, wait

folder = Path(sys.argv[1])
seen = Choices(tours=("home", "flight"))
ChoiceFile(folder / "trainee.json").save(seen)
desk = opened_desk(folder)
window, Key, Left = desk._window, Qt.Key, Qt.MouseButton.LeftButton
def press(key):
    QTest.keyClick(window.page.focusWidget() or window.page, key)
def shown(kind):
    until(kind.__name__, lambda: isinstance(window.page, kind))
    return window.page
def end():
    desk.close()
    window.shut()
    window.release()
    until("all is read", lambda: not desk._works)
window.show()
"""

STOPPED = (
    WINDOW
    + """
# as `paravol train --scenario centring` does
def broken(scenario, progress):
    raise UserError("This head has no nose.")
whole, flight.load_patient = flight.load_patient, broken
desk.take_off(desk._setup.order("centring"), partial(desk.fly, "centring"))
page = shown(EndedPage)
assert page.problem.text() == "This head has no nose."
window.grab().save(str(folder / "ended.png"))
QTest.mouseClick(page.again, Left)
until("another", lambda: isinstance(window.page, EndedPage) and window.page is not page)
press(Key.Key_H)
home = shown(HomePage)
until("a ladder", lambda: home.go_on.text())
assert window.isVisible()

# Esc gives up what is being prepared, wherever that is
def endless(scenario, progress):
    while True:
        progress("Making the head", 0.5)
        time.sleep(0.02)
flight.load_patient = endless
press(Key.Key_Return)
page = shown(FlightPage)
until("a stage", lambda: page.picture._message.startswith("Making the head"))
press(Key.Key_Escape)
home = shown(HomePage)
assert window.isVisible()
until("a ladder", lambda: home.go_on.text())
order = type(desk._setup).order
def slow(setup, name, *more):
    time.sleep(1.0)
    return order(setup, name, *more)
type(desk._setup).order = slow
press(Key.Key_Return)
assert "Preparing" in home.stage.text()
assert home.stage.isVisible()
press(Key.Key_Escape)
assert not home.stage.isVisible()
until("the order", lambda: not desk._works)
wait()
assert window.page is home
# what is raised in a slot is told, and closes nothing
from app.cli.page_window import errors_of_slots
from PySide6.QtCore import QTimer
import contextlib, io
with errors_of_slots(window.tell) as errors, contextlib.redirect_stderr(io.StringIO()):
    QTimer.singleShot(0, lambda: 1 // 0)
    until("an error", lambda: errors)
assert "ZeroDivisionError" in home.problem.text()
assert window.isVisible()
# Ctrl+Q ends the program on every page
QTest.keyClick(home, Key.Key_Q, Qt.KeyboardModifier.ControlModifier)
assert not window.isVisible()
end()
"""
)


@pytest.mark.display
def test_nothing_closes_the_window_but_the_user(
    screen: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    run_script(STOPPED, tmp_path)


CLOCK = (
    WINDOW
    + """
from scenarios.session import Session
desk.take_off(desk._setup.order("centring"), partial(desk.fly, "centring"))
page = shown(FlightPage)
frames = []
take = page._thread.take
def watched():
    frame = take()
    if frame is not None:
        frames.append(frame)
    return frame
page._thread.take = watched
until("a picture", lambda: page._frame is not None)
until("a clock", lambda: not page._frame.is_frozen)
assert frames[0].is_frozen
assert not page._overview._image.isNull()
assert page._overview.has_head
told = page._readings().time_s
assert told < 5.0, told

def frozen(is_on):
    until(f"frozen: {is_on}", lambda: page._frame.is_frozen == is_on)
def settings():
    return window.findChild(SettingsDialog)
press(Key.Key_F1)
frozen(True)
assert not page._help.isHidden()
press(Key.Key_F1)
frozen(False)
press(Key.Key_F2)
until("settings", settings)
frozen(True)
QTest.keyClick(settings(), Key.Key_Escape)
until("no settings", lambda: settings() is None)
frozen(False)
# given back as it was
press(Key.Key_P)
frozen(True)
press(Key.Key_F1)
QTest.mouseClick(page._help, Left)
assert page._help.isHidden()
for _ in range(10):
    wait(50)
    assert page._frame.is_frozen
press(Key.Key_P)
frozen(False)

# A stall: what was steered blindly is not flown
step = Session.step
def stalled(session, sample):
    Session.step = step
    time.sleep(3.0)
    step(session, sample)
before = page._frame
said = []
say = page.picture.say
def spoken(message, *rest):
    said.append(message)
    say(message, *rest)
page.picture.say = spoken
Session.step = stalled
middle = QPointF(page.picture.rect().center())
for _ in range(30):
    wheel = QWheelEvent(
        middle, page.picture.mapToGlobal(middle), QPoint(), QPoint(0, 120),
        Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase, False,
    )
    application.sendEvent(page.picture, wheel)
    wait(50)
until("a word", lambda: "The flight stood still" in said)
until("flight", lambda: page._frame.time_s > before.time_s + 1.0)
way = page._frame.view.world_from_tip[:3, 3] - before.view.world_from_tip[:3, 3]
assert abs(way).max() < 8.0, way
# nor does its time count
assert page._frame.time_s < before.time_s + 3.0
press(Key.Key_Q)
press(Key.Key_Return)
from app.window.result.result_page import ResultPage
result = shown(ResultPage)
until("a score", lambda: result.parts.isVisible())
record = desk.flown[0].end.record
end()
from app.__main__ import main
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
    assert main(["replay", str(record), "--check"]) == 0
"""
)


@pytest.mark.display
@pytest.mark.slow
def test_the_clock_stands_while_nothing_can_be_seen_and_a_stall_throws_nothing(
    screen: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    run_script(CLOCK, tmp_path)


DEBRIEFED = (
    WINDOW
    + """
from app.window.result.result_page import ResultPage
from tests.paravol.trainee import hoops_flight

(folder / "sessions").mkdir()
record = hoops_flight.record(folder / "sessions" / "a.paravol", has_end=False)
desk.open_home()
until("an offer", lambda: window.page.recovery._left)
window.page.recovery.recover.click()
until("a result", lambda: isinstance(window.page, ResultPage))
page = window.page
until("a score", lambda: page.parts.isVisible())
assert page._about.text()
assert (record / "result.json").is_file()
staged = []
show = page.written.show_stage
def stage(words, share=0.0):
    staged.append((words, share))
    show(words, share)
page.written.show_stage = stage
QTest.mouseClick(page.debrief, Left)
assert page.written.bar.isVisible()
until("a debrief", lambda: page.written.copy.isVisible())
file = record / "debrief.html"
assert file.is_file()
assert len({words for words, _ in staged}) > 2, staged
assert any(0.0 < share < 1.0 for _, share in staged), staged
assert not page.written.bar.isVisible()
told = page.written.words.text()
assert told == f"No browser could be opened. The debrief is in {file}", told
window.grab().save(str(folder / "debrief.png"))
QTest.mouseClick(page.written.copy, Left)
assert application.clipboard().text() == str(file)
QTest.mouseClick(page.written.folder, Left)
until("a word", lambda: "No program could open" in page.problem.text())
end()
assert [flown.is_kept for flown in desk.flown] == [True]
"""
)


@pytest.mark.display
@pytest.mark.slow
def test_a_flight_that_was_cut_off_is_recovered_and_debriefed_without_a_browser(
    screen: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    tools = tmp_path / "tools"
    tools.mkdir()
    talkative = tools / "xdg-open"
    talkative.write_text("#!/bin/sh\necho no browser >&2\nexit 3\n")
    talkative.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tools}:{os.environ['PATH']}")
    run_script(DEBRIEFED, tmp_path)
