"""A tour: what it points at, the keys that lead through it, and its end."""

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QRect, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFrame, QLabel, QPushButton, QWidget

from app.window.texts import LANGUAGES, take_language
from app.window.tour import Tour, TourStop
from tests.app.window.desk_run import delete

SIZES = [(1088, 680), (1280, 720), (3840, 2160)]


@pytest.fixture
def page(application: QApplication) -> Iterator[QWidget]:
    page = QWidget()
    page.resize(1280, 720)
    corners = [(0, 0), (1180, 0), (0, 690), (1180, 690), (500, 300)]
    for number, (x, y) in enumerate(corners):
        part = QLabel(f"part {number}", page)
        part.setGeometry(x, y, 100, 30)
    hidden = QLabel("hidden", page)
    hidden.hide()
    page.show()
    yield page
    page.close()
    delete(page)


def parts(page: QWidget) -> list[QLabel]:
    return [p for p in page.findChildren(QLabel) if p.parent() is page]


def test_keys_lead_forth_and_back_and_parts_that_are_not_there_are_left_out(
    page: QWidget,
) -> None:
    stops = [TourStop(None, "all", "of it")]
    stops += [TourStop(part, part.text(), "text") for part in parts(page)]
    tour = Tour(page, stops, 1.0)
    ended: list[bool] = []
    tour.ended.connect(lambda: ended.append(True))
    assert tour.hasFocus() or tour.focusWidget() is tour
    told = [tour.stop.title]
    for key in (Qt.Key.Key_Return, Qt.Key.Key_Space, Qt.Key.Key_Right):
        QTest.keyClick(tour, key)
        told.append(tour.stop.title)
    QTest.keyClick(tour, Qt.Key.Key_Left)
    told.append(tour.stop.title)
    assert told == ["all", "part 0", "part 1", "part 2", "part 1"]
    for _ in range(3):
        QTest.keyClick(tour, Qt.Key.Key_Return)
    assert tour.stop.title == "part 4"
    assert not ended
    QTest.keyClick(tour, Qt.Key.Key_Return)
    assert ended == [True]
    assert tour.isHidden()


def test_a_tour_can_be_skipped(page: QWidget) -> None:
    tour = Tour(page, [TourStop(None, "all", "of it")] * 3, 1.0)
    ended: list[bool] = []
    tour.ended.connect(lambda: ended.append(True))
    QTest.keyClick(tour, Qt.Key.Key_Escape)
    assert ended == [True]


@pytest.mark.parametrize("size", SIZES)
def test_the_card_is_whole_and_hides_nothing_that_it_tells_of(
    page: QWidget, size: tuple[int, int]
) -> None:
    long = "A text of some length, so that the card has several lines. " * 3
    stops = [TourStop(part, part.text(), long) for part in parts(page)]
    tour = Tour(page, stops, 1.0)
    page.resize(*size)
    QApplication.processEvents()
    assert tour.size() == page.size()
    for stop in tour._stops:
        card = tour.findChild(QFrame, "card")
        assert card is not None
        box = card.geometry()
        assert tour.rect().contains(box)
        assert stop.part is not None
        assert not box.intersects(QRect(stop.part.pos(), stop.part.size()))
        for label in card.findChildren(QLabel):
            high = label.heightForWidth(label.width())
            assert label.height() >= high, (label.text(), size)
        QTest.keyClick(tour, Qt.Key.Key_Return)


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("scale", [1.0, 1.5])
def test_buttons_are_as_wide_as_what_they_say(
    page: QWidget, language: str, scale: float
) -> None:
    take_language(language)
    try:
        tour = Tour(page, [TourStop(None, "one", "of two")] * 2, scale)
        for _ in range(2):
            QApplication.processEvents()
            for button in tour.findChildren(QPushButton):
                assert button.width() >= button.sizeHint().width(), button.text()
            tour._go_on()
    finally:
        take_language("en")
