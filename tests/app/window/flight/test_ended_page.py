"""The page of a flight that has ended by an error: its keys and its words."""

from collections.abc import Iterator

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.flight.ended_page import EndedPage
from tests.app.window.desk_run import delete


@pytest.fixture
def page(application: QApplication) -> Iterator[EndedPage]:
    page = EndedPage("Centring", "The arm was lost.")
    page.set_scale(1.0)
    page.show()
    yield page
    page.close()
    delete(page)


def test_it_says_why_and_leads_home_or_into_the_air_again(page: EndedPage) -> None:
    ways: list[str] = []
    page.again_wanted.connect(lambda: ways.append("again"))
    page.home_wanted.connect(lambda: ways.append("home"))
    assert page.problem.isVisible()
    assert page.problem.text() == "The arm was lost."
    assert not page.stage.isVisible()
    for key in (Qt.Key.Key_A, Qt.Key.Key_H, Qt.Key.Key_Escape):
        QTest.keyClick(page, key)
    QTest.keyClick(page.focusWidget() or page, Qt.Key.Key_Return)
    QTest.mouseClick(page.home, Qt.MouseButton.LeftButton)
    assert ways == ["again", "home", "home", "again", "home"]
