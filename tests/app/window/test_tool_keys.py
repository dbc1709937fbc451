"""A trainee operates with the window's keys: a bite, its undoing, and what is told."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.display, pytest.mark.slow]

ROOT = Path(__file__).parents[2]
LIMIT_S = 240.0

BITE = """
import sys, time
import numpy as np
from PySide6.QtCore import QEvent, QEventLoop, Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment
prepare_environment()
from paravol.inputs import choose_input
from app.window.main_window import TraineeWindow
from paravol.flight import FlightOrder
from app.window.flight_thread import FlightThread
from devices import load_probe_path
from scenarios import load_scenario
from scenarios.instruments import INSTRUMENTS

application = QApplication([])
scenario, folder = load_scenario(sys.argv[1])
file = folder / scenario.path
path = load_probe_path(file)
mouse = choose_input("mouse", None, scenario, path, file)
flight = FlightThread(FlightOrder(scenario, path, mouse, 128, 1, None))
window = TraineeWindow(flight, edge_samples=0)
hand, Key = flight.flight.hand, Qt.Key
seen = []
take = flight.take
def watched():
    instant = take()
    if instant is not None:
        seen.append(instant)
    return instant
flight.take = watched
window.show()
flight.start()

def until(what, holds):
    count, began = -1, time.monotonic()
    while flight.error is None and (len(seen) == count or not seen or not holds()):
        count = len(seen)
        assert time.monotonic() - began < 200.0, (what, count, seen[-1:])
        loop = QEventLoop()
        QTimer.singleShot(20, loop.quit)
        loop.exec()
    assert flight.error is None, flight.error

def place(index):
    count = len(seen) + index
    return seen[max(count, 0)].view.world_from_tip

def again(kind, key):
    application.sendEvent(
        window, QKeyEvent(kind, key, Qt.KeyboardModifier.NoModifier, "", True)
    )

until("a frame", lambda: True)
assert seen[-1].tool.name == ""
# the tools come in order, with an empty hand between the last and the first
names = []
for _ in range(len(INSTRUMENTS) + 1):
    QTest.keyClick(window, Key.Key_T)
    again(QEvent.Type.KeyPress, Key.Key_T)
    names.append(hand.tool)
assert names == [*INSTRUMENTS, ""], names
QTest.keyClick(window, Key.Key_T, Qt.KeyboardModifier.ShiftModifier)
assert hand.tool == names[-2]
while hand.tool != "straight forceps":
    QTest.keyClick(window, Key.Key_T)
assert "forceps" in window.picture._message
until("a tool", lambda: seen[-1].tool.name == "straight forceps")
assert seen[-1].cuts == 0
QTest.keyPress(window, Key.Key_W)
until("depth", lambda: seen[-1].time_s > seen[0].time_s + 1.0)
QTest.keyRelease(window, Key.Key_W)
# held, the key brings the tool to the wall that the scope looks at
for _ in range(40):
    again(QEvent.Type.KeyPress, Key.Key_PageUp)
until("a halt", lambda: np.array_equal(place(-1), place(-2)))
QTest.keyPress(window, Key.Key_B)
again(QEvent.Type.KeyPress, Key.Key_B)
again(QEvent.Type.KeyRelease, Key.Key_B)
until("a bite", lambda: seen[-1].tool.jaw == 1.0 and seen[-1].cuts == 1)
window._refresh()
assert window._side._tool.text() == "straight forceps · jaws closed"
QTest.keyRelease(window, Key.Key_B)
until("open jaws", lambda: seen[-1].tool.jaw == 0.0)
QTest.keyClick(window, Key.Key_Z)
until("the bite's undoing", lambda: seen[-1].cuts == 2)
# a key that is down when the window loses the keyboard does not stick
QTest.keyPress(window, Key.Key_B)
until("closing jaws", lambda: seen[-1].tool.is_working)
application.sendEvent(window, QEvent(QEvent.Type.WindowDeactivate))
until("a pedal let go", lambda: not seen[-1].tool.is_working)
for key, told in ((Key.Key_N, True), (Key.Key_N, False)):
    QTest.keyClick(window, key)
    again(QEvent.Type.KeyPress, key)
    until("suction", lambda: seen[-1].tool.is_sucking is told)
QTest.keyClick(window, Key.Key_L)
QTest.keyClick(window, Key.Key_Home)
until("a wash", lambda: seen[-1].tool.washed == 1)
assert seen[-1].tool.roll_deg > 0.0
# an injury is said, and rings the picture while it is new
flight.on_injury("orbit, right: through the lamina papyracea, by the curette")
until("an injury", lambda: window.picture._alarm == "injury: orbit, right")
assert window.picture._message == "Injury: orbit, right"
assert window.picture._detail == "through the lamina papyracea, by the curette"
if len(sys.argv) > 2:
    window.grab().save(sys.argv[2])
window._injured_until_s = 0.0
until("calm", lambda: window.picture._alarm == "")
QTest.keyClick(window, Key.Key_Q)
QTest.keyClick(window, Key.Key_Return)
until_s = time.monotonic() + 60.0
while window.picture._result is None and time.monotonic() < until_s:
    loop = QEventLoop()
    QTimer.singleShot(20, loop.quit)
    loop.exec()
operation = flight.flight.result.score.operation
assert operation.washes == 1
if len(sys.argv) > 3:
    window.grab().save(sys.argv[3])
window.close()
assert flight.stop(60.0)
window.release()
print(flight.flight.result.rows())
"""


def test_keys_bite_undo_suck_and_wash(screen: str, coarse_scenario: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", BITE, str(coarse_scenario)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
    )
    assert (done.returncode, done.stderr) == (0, "")
