"""The home page: what it lists, what it starts, and how it is used by keys."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel

from app.window.home.exercise_list import OPEN_CASE
from app.window.home.home_page import HomePage
from paravol.sessions.unfinished_sessions import UnfinishedSession
from paravol.trainee.cases import KnownCase
from paravol.trainee.exercises import ladder_of
from paravol.trainee.found_devices import FoundDevice
from tests.app.window.desk_run import delete
from tests.paravol.progress.learners import entry

CASE = KnownCase(Path("/heads/mine"), "mine", "CT head")


@pytest.fixture
def page(application: QApplication) -> Iterator[HomePage]:
    page = HomePage()
    page.set_scale(1.0)
    page.resize(1280, 720)
    runs = [entry(number=n, percent=70.0 + n, has_passed=True) for n in (1, 2, 3)] + [
        entry(number=9, exercise="centring", percent=99.0, has_passed=False)
    ]
    page.show_ladder(ladder_of(runs), [CASE], "hoops")
    page.show()
    yield page
    page.release()
    page.close()
    delete(page)


def rows(page: HomePage) -> dict[str, list[str]]:
    found = {}
    for number in range(page.list.topLevelItemCount()):
        item = page.list.topLevelItem(number)
        assert item is not None
        found[item.text(0)] = [item.text(column) for column in range(1, 5)]
    return found


def test_each_line_tells_how_one_stands(page: HomePage) -> None:
    told = rows(page)
    assert told["Hoops: pass the tip through six rings"] == [
        "✓ passed", "3", "✓ 73", "73",
    ]  # fmt: skip
    assert told["Centring: look at eight signs, one after the other"] == [
        "open", "1", "✗ 1/2", "",
    ]  # fmt: skip
    assert told["Uncinectomy, right side"] == ["locked", "", "", ""]
    assert told["mine"][0] == "open"
    assert list(told)[-1] == OPEN_CASE
    for level in ("Novice", "Intermediate", "Advanced"):
        assert level in told


def test_enter_starts_what_is_worth_doing_and_what_is_selected(page: HomePage) -> None:
    wanted: list[object] = []
    page.exercise_wanted.connect(wanted.append)
    page.case_wanted.connect(wanted.append)
    assert page.go_on.text() == "Continue: Centring"
    assert page.focusWidget() is page.go_on
    QTest.keyClick(page.go_on, Qt.Key.Key_Return)
    assert wanted == ["centring"]
    page.list.select("hoops")
    page.list.setFocus()
    QTest.keyClick(page.list, Qt.Key.Key_Return)
    assert wanted == ["centring", "hoops"]
    last = page.list.topLevelItem(page.list.topLevelItemCount() - 2)
    assert last is not None
    page.list.setCurrentItem(last)
    page.card.start.click()
    assert wanted == ["centring", "hoops", CASE.folder]


def test_what_somebody_chose_stays_chosen_when_the_list_is_read_anew(
    page: HomePage,
) -> None:
    ladder = ladder_of([])
    page.show_ladder(ladder, [CASE])
    following = page.list.current
    assert following is not None
    QTest.keyClick(page.list, Qt.Key.Key_Down)
    chosen = page.list.current
    assert chosen is not None
    assert chosen.exercise is not None
    assert chosen != following
    page.show_ladder(ladder, [CASE])
    again = page.list.current
    assert again is not None
    assert again.exercise is not None
    assert again.exercise.name == chosen.exercise.name


def test_headings_cannot_be_chosen(page: HomePage) -> None:
    item = page.list.topLevelItem(0)
    assert item is not None
    assert item.text(0) == "Novice"
    assert item.flags() == Qt.ItemFlag.NoItemFlags


def test_nothing_starts_while_something_is_prepared(page: HomePage) -> None:
    page.show_stage("Preparing", 0.5)
    assert not page.go_on.isEnabled()
    assert not page.list.isEnabled()
    page.show_stage("")
    assert page.go_on.isEnabled()
    assert page.list.isEnabled()


def test_devices_are_offered_and_told(page: HomePage) -> None:
    chosen: list[FoundDevice] = []
    page.bar.device_chosen.connect(chosen.append)
    mouse = FoundDevice("mouse", "Mouse")
    port = FoundDevice("arm:/dev/x", "An arm", "/dev/x may not be opened.")
    page.bar.show_devices([mouse], "mouse", is_all=False)
    assert "looking for more" in page.bar.device.currentText()
    page.bar.show_devices([mouse, port], "arm:/dev/x", is_all=True)
    assert page.bar.device.currentText() == "An arm (not usable)"
    page.bar.device.setCurrentIndex(0)
    page.bar.device.activated.emit(0)
    assert chosen == [mouse]


def test_unfinished_flights_are_asked_for_one_by_one(page: HomePage) -> None:
    sessions = [
        UnfinishedSession(Path(f"/s/{n}"), f"Title {n}", "2026-03-01T10:00:00+00:00", n)
        for n in (1.0, 2.0)
    ]
    told: list[tuple[str, UnfinishedSession]] = []
    page.recovery.recover_wanted.connect(lambda s: told.append(("recover", s)))
    page.recovery.keep_wanted.connect(lambda s: told.append(("keep", s)))
    page.recovery.show_unfinished(sessions)
    assert page.recovery.isVisible()
    page.recovery.keep.click()
    page.recovery.recover.click()
    assert told == [("keep", sessions[0]), ("recover", sessions[1])]
    assert not page.recovery.isVisible()


@pytest.mark.parametrize(("width", "scale"), [(1280, 0.9), (1920, 1.35), (3840, 2.7)])
def test_nothing_is_cut_off(page: HomePage, width: int, scale: float) -> None:
    page.set_scale(scale)
    page.resize(width, width * 9 // 16)
    page.say("A problem that takes some words. " * 6)
    QApplication.processEvents()
    for label in page.findChildren(QLabel):
        if label.isVisible() and label.wordWrap():
            assert label.height() >= label.heightForWidth(label.width()), label.text()
    for part in (page.bar, page.go_on, page.list, page.card, page.problem):
        assert page.rect().contains(part.geometry()), part
