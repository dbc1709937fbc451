"""The page of an arm on a virtual screen, with the emulated arm."""

from pathlib import Path

import pytest

from tests.app.window.opened_window import run_script

pytestmark = pytest.mark.display

SCRIPT = """
import sys
from pathlib import Path
from PySide6.QtCore import QEventLoop, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment
prepare_environment()
from app.window.connection import arm_thread, connection_page
from app.window.connection.connection_page import NONE, ConnectionPage
from app.window.main_window import MainWindow
from paravol.trainee.found_devices import FoundDevice

scenario, folder, shot = sys.argv[1], Path(sys.argv[2]), sys.argv[3]
arm_thread.HEAD = connection_page.HEAD = scenario
application = QApplication([])
window = MainWindow()
devices = [FoundDevice("mouse", "Mouse"), FoundDevice("arm:/dev/no_such", "Arm")]
page = ConnectionPage(devices, folder)
window.show_page(page)
window.show()

def wait(what, holds):
    for _ in range(3000):
        if holds():
            return
        loop = QEventLoop()
        QTimer.singleShot(20, loop.quit)
        loop.exec()
    raise AssertionError((what, page.log.toPlainText(), page.problem.text()))

# a port that is not there is told, and nothing else is lost
wait("a problem", lambda: "/dev/no_such" in page.problem.text())
page.chooser.setCurrentIndex(1)
wait("poses", lambda: page.figures["Poses"].text() != NONE)
assert page.problem.text() == ""
assert len(page.figures["Counts"].text().split()) == 6
assert "MicroScribe" in page.figures["Arm"].text()
if shot:
    window.resize(1280, 720)
    QTest.keyClick(page.start, Qt.Key.Key_Space)
    wait("figures", lambda: "Registered" in page.state.text())
    window.grab().save(shot)
    assert "truly" in page.log.toPlainText()
    wait("the arm again", lambda: page.figures["Poses"].text() != NONE)
else:
    QTest.keyClick(page.start, Qt.Key.Key_Space)
    wait("a step", lambda: page.step.text() != "")
    QTest.keyClick(page.start, Qt.Key.Key_Space)
    assert "nothing was written" in page.log.toPlainText()
    wait("the arm again", lambda: page.figures["Poses"].text() != NONE)
assert not folder.exists()
window.shut()
window.release()
"""


@pytest.mark.slow
def test_an_arm_is_looked_at_and_a_registration_can_be_ended(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    run_script(SCRIPT, coarse_scenario, tmp_path / "registrations", "")


@pytest.mark.slow
def test_the_emulated_arm_is_registered_in_the_window(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    shot = tmp_path / "registered.png"
    run_script(SCRIPT, coarse_scenario, tmp_path / "registrations", shot)
    assert shot.stat().st_size > 10_000
