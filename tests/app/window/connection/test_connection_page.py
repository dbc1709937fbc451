"""The page of an arm, with the emulated arm."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.connection import arm_thread, connection_page
from app.window.connection.connection_page import NONE, ConnectionPage
from app.window.main_window import MainWindow
from paravol.trainee.found_devices import FoundDevice
from tests.app.window.desk_run import delete, until

DEVICES = [FoundDevice("mouse", "Mouse"), FoundDevice("arm:/dev/no_such", "Arm")]


@pytest.fixture
def page(
    application: QApplication,
    coarse_scenario: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[ConnectionPage]:
    """The page with the emulated arm, after one at a port that is not there."""
    for module in (arm_thread, connection_page):
        monkeypatch.setattr(module, "HEAD", str(coarse_scenario))
    window, folder = MainWindow(), tmp_path / "registrations"
    page = ConnectionPage(DEVICES, folder)
    window.show_page(page)
    window.resize(1280, 720)
    window.show()
    # the port is told, and nothing else is lost
    until("a problem", lambda: "/dev/no_such" in page.problem.text())
    page.chooser.setCurrentIndex(1)
    until("poses", lambda: page.figures["Poses"].text() != NONE)
    assert page.problem.text() == ""
    assert len(page.figures["Counts"].text().split()) == 6
    assert "MicroScribe" in page.figures["Arm"].text()
    QTest.keyClick(page.start, Qt.Key.Key_Space)
    yield page
    until("the arm again", lambda: page.figures["Poses"].text() != NONE)
    assert not folder.exists()
    window.shut()
    window.release()
    delete(window)


@pytest.mark.slow
def test_an_arm_is_looked_at_and_a_registration_can_be_ended(
    page: ConnectionPage,
) -> None:
    until("a step", lambda: page.step.text() != "")
    QTest.keyClick(page.start, Qt.Key.Key_Space)
    assert "nothing was written" in page.log.toPlainText()


@pytest.mark.slow
def test_the_emulated_arm_is_registered_in_the_window(
    page: ConnectionPage, tmp_path: Path
) -> None:
    until("figures", lambda: "Registered" in page.state.text())
    assert "truly" in page.log.toPlainText()
    assert page.grab().save(str(tmp_path / "registered.png"))
    assert (tmp_path / "registered.png").stat().st_size > 10_000
