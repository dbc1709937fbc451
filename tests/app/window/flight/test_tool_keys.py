"""A trainee operates with the window's keys: a bite, its undoing, and what is told."""

from pathlib import Path

import pytest

from tests.app.window.opened_window import run_script

pytestmark = [pytest.mark.display, pytest.mark.slow]

BITE = """
import sys, time
import numpy as np
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from app.window.keyboard.actions import Act
from paravol.flight.flight_events import Injured
from scenarios.instruments import INSTRUMENTS
from tests.app.window.opened_window import OpenedWindow

opened = OpenedWindow(sys.argv[1])
flight, window, seen = opened.flight, opened.window, opened.seen
page = opened.page
until, application = opened.until, opened.application
hand, Key = flight.flight.hand, Qt.Key

def place(index):
    count = len(seen) + index
    return seen[max(count, 0)].view.world_from_tip

def again(kind, key):
    application.sendEvent(
        page, QKeyEvent(kind, key, Qt.KeyboardModifier.NoModifier, "", True)
    )

opened.start()
assert seen[-1].tool.name == ""
# the tools come in order, with an empty hand between the last and the first
names = []
for _ in range(len(INSTRUMENTS) + 1):
    QTest.keyClick(page, Key.Key_T)
    again(QEvent.Type.KeyPress, Key.Key_T)
    names.append(hand.tool)
assert names == [*INSTRUMENTS, ""], names
QTest.keyClick(page, Key.Key_T, Qt.KeyboardModifier.ShiftModifier)
assert hand.tool == names[-2]
while hand.tool != "straight forceps":
    QTest.keyClick(page, Key.Key_T)
assert "forceps" in page.picture._message
until("a tool", lambda: seen[-1].tool.name == "straight forceps")
assert seen[-1].cuts == 0
QTest.keyPress(page, Key.Key_W)
until("depth", lambda: seen[-1].time_s > seen[0].time_s + 1.0)
QTest.keyRelease(page, Key.Key_W)
# held, the key brings the tool to the wall that the scope looks at
for _ in range(40):
    again(QEvent.Type.KeyPress, Key.Key_PageUp)
until("a halt", lambda: np.array_equal(place(-1), place(-2)))
QTest.keyPress(page, Key.Key_B)
again(QEvent.Type.KeyPress, Key.Key_B)
again(QEvent.Type.KeyRelease, Key.Key_B)
until("a bite", lambda: seen[-1].tool.jaw == 1.0 and seen[-1].cuts == 1)
page._tick()
assert page._side._tool.text() == "In hand: straight forceps · jaws closed"
QTest.keyRelease(page, Key.Key_B)
until("open jaws", lambda: seen[-1].tool.jaw == 0.0)
QTest.keyClick(page, Key.Key_Z)
until("the bite's undoing", lambda: seen[-1].cuts == 2)
# a key that is down when the window loses the keyboard does not stick
QTest.keyPress(page, Key.Key_B)
until("closing jaws", lambda: seen[-1].tool.is_working)
application.sendEvent(window, QEvent(QEvent.Type.WindowDeactivate))
until("a pedal let go", lambda: not seen[-1].tool.is_working)
# the middle button of the mouse is the pedal, too
wheel = Qt.MouseButton.MiddleButton
QTest.mousePress(page.picture, wheel)
until("a pressed wheel", lambda: seen[-1].tool.is_working)
QTest.mouseRelease(page.picture, wheel)
until("a wheel let go", lambda: not seen[-1].tool.is_working)
# a button of the bar does what its key does, and a menu takes what it names
bar = page._actions.bar
left = Qt.MouseButton.LeftButton
QTest.mousePress(bar.button(Act.WORK), left)
until("a pressed button", lambda: seen[-1].tool.is_working)
QTest.mouseRelease(bar.button(Act.WORK), left)
until("a button let go", lambda: not seen[-1].tool.is_working)
QTest.keyClick(page, Key.Key_O)
until("a scope of 30 degrees", lambda: seen[-1].view.scope_deg == 30.0)
bar.menu(Act.NEXT_SCOPE).actions()[0].trigger()
until("a straight scope", lambda: seen[-1].view.scope_deg == 0.0)
page._tick()
assert bar.button(Act.NEXT_SCOPE).text() == "0° scope\\nO"
bar.menu(Act.NEXT_TOOL).actions()[1].trigger()
assert hand.tool == next(iter(INSTRUMENTS))
for key, told in ((Key.Key_N, True), (Key.Key_N, False)):
    QTest.keyClick(page, key)
    again(QEvent.Type.KeyPress, key)
    until("suction", lambda: seen[-1].tool.is_sucking is told)
QTest.keyClick(page, Key.Key_L)
QTest.keyClick(page, Key.Key_Home)
until("a wash", lambda: seen[-1].tool.washed == 1)
assert seen[-1].tool.roll_deg > 0.0
# an injury is said, and rings the picture while it is new
flight.hear(Injured("orbit, right: through the lamina papyracea, by the curette"))
until("an injury", lambda: page.picture._alarm == "injury: orbit, right")
assert page.picture._message == "Injury: orbit, right"
assert page.picture._detail == "through the lamina papyracea, by the curette"
if len(sys.argv) > 2:
    window.grab().save(sys.argv[2])
page._injured_until_s = 0.0
until("calm", lambda: page.picture._alarm == "")
QTest.keyClick(page, Key.Key_Q)
QTest.keyClick(page, Key.Key_Return)
until_s = time.monotonic() + 60.0
while page.picture._result is None and time.monotonic() < until_s:
    opened.wait()
operation = flight.flight.result.score.operation
assert operation.washes == 1
if len(sys.argv) > 3:
    window.grab().save(sys.argv[3])
opened.close()
print(flight.flight.result.rows())
"""


def test_keys_bite_undo_suck_and_wash(screen: str, coarse_scenario: Path) -> None:
    run_script(BITE, coarse_scenario)
