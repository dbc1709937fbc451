"""The way through the window: home, flight, result, and what cannot be flown."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.desk import Desk
from app.window.home.home_page import HomePage
from paravol.session_store import SessionStore
from paravol.trainee import ChoiceFile, Choices
from paravol.training_setup import DeviceSetup
from paravol.unfinished_sessions import unfinished_sessions
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
def desk(application: QApplication, folder: Path) -> Iterator[Desk]:
    desk = opened_desk(folder)
    desk.open_home()
    yield desk
    desk.close()
    shut(desk)


def shut(desk: Desk) -> None:
    until("all is read", lambda: not desk._works)
    desk._window.shut()
    desk._window.release()
    delete(desk._window)


def home(desk: Desk) -> HomePage:
    page = desk._window.page
    assert isinstance(page, HomePage)
    return page


def filled(desk: Desk) -> HomePage:
    page = home(desk)
    until("a ladder", lambda: page.go_on.text())
    return page


def test_a_locked_exercise_is_not_flown_but_told(desk: Desk) -> None:
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
    desk: Desk, folder: Path
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
    desk: Desk, folder: Path
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


THROUGH = """
import sys
from pathlib import Path
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment

prepare_environment()
application = QApplication([])
from app.window.flight.flight_page import FlightPage
from app.window.home.home_page import HomePage
from app.window.result.result_page import ResultPage
from app.window.tour import Tour
from paravol.progress import ProgressStore
from tests.app.window.desk_run import opened_desk, until, wait

folder = Path(sys.argv[1])
desk = opened_desk(folder)
window, Key = desk._window, Qt.Key
def press(key):
    QTest.keyClick(window.page.focusWidget() or window.page, key)
def shown(kind):
    until(kind.__name__, lambda: isinstance(window.page, kind))
    return window.page
def seen_tour(page):
    # a tour takes the keyboard, and gives it back
    count = 0
    while (tour := page.findChild(Tour)) is not None and not tour.isHidden():
        QTest.keyClick(tour, Key.Key_Return)
        count += 1
        assert count < 8
        wait()
    return count
def fly_and_end(page):
    until("a picture", lambda: page._frame is not None)
    tour = seen_tour(page)
    frame = page._frame
    QTest.keyPress(page, Key.Key_W)
    until("it moves", lambda: page._frame.view.world_from_tip[1, 3]
          != frame.view.world_from_tip[1, 3])
    QTest.keyRelease(page, Key.Key_W)
    until("a second", lambda: page._frame.time_s > frame.time_s + 1.0)
    QTest.keyClick(page, Key.Key_Q)
    assert isinstance(window.page, FlightPage)  # it asks
    QTest.keyClick(page, Key.Key_Return)
    return tour
def scored():
    page = shown(ResultPage)
    until("a score", lambda: page.parts.isVisible())
    assert page.problem.text() == "", page.problem.text()
    return page

window.show()
desk.open_home()
page = shown(HomePage)
until("a ladder", lambda: page.go_on.text())
assert seen_tour(page) == 5
assert page.focusWidget() is page.go_on
press(Key.Key_Return)
assert fly_and_end(shown(FlightPage)) >= 3
page = scored()
assert page.verdict.text() == "Not passed yet"
assert page.points.text() == "0 of 8 tasks"
assert page.following.text() == "Next: Hoops (N)"
press(Key.Key_A)
assert fly_and_end(shown(FlightPage)) == 0
page = scored()
press(Key.Key_H)
page = shown(HomePage)
until("both", lambda: page.list.current is not None
      and len(page.list.current.exercise.attempts) == 2)
assert page.go_on.text() == "Continue: Centring"
assert page.findChild(Tour) is None
window.shut()
desk.close()
window.release()
assert [flown.is_kept for flown in desk.flown] == [True, True]
for flown in desk.flown:
    assert (flown.end.record / "result.json").is_file()
assert len(ProgressStore(folder / "progress.sqlite").sessions()) == 2
"""


@pytest.mark.display
@pytest.mark.slow
def test_a_trainee_goes_through_the_window_by_keys(
    screen: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    run_script(THROUGH, tmp_path)


RECOVERED = """
import sys
from pathlib import Path
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment

prepare_environment()
application = QApplication([])
from app.window.result.result_page import ResultPage
from tests.app.window.desk_run import opened_desk, until
from tests.paravol.trainee import hoops_flight

folder = Path(sys.argv[1])
(folder / "sessions").mkdir()
killed = hoops_flight.record(folder / "sessions" / "a.paravol", has_end=False)
desk = opened_desk(folder)
window = desk._window
window.show()
desk.open_home()
until("an offer", lambda: window.page.recovery._left)
window.page.recovery.recover.click()
until("a result", lambda: isinstance(window.page, ResultPage))
until("a score", lambda: window.page.parts.isVisible())
assert "hoops" in window.page._about.text().lower() or window.page._about.text()
assert (killed / "result.json").is_file()
window.shut()
desk.close()
window.release()
assert [flown.is_kept for flown in desk.flown] == [True]
"""


@pytest.mark.display
@pytest.mark.slow
def test_a_flight_that_was_cut_off_is_recovered_and_scored(
    screen: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    run_script(RECOVERED, tmp_path)
