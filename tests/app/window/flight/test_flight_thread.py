"""The real window, flown with the mouse for longer than anybody's patience."""

import sys
from pathlib import Path

import pytest

from tests.app.window.opened_window import run_script

pytestmark = [pytest.mark.display, pytest.mark.slow, pytest.mark.timeout(900)]

FLOWN_S = 200.0

NOISE = 2000
"""References to None that a running flight may hold or give back."""

FLY = """
import math, random, sys, time
from pathlib import Path
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from tests.app.window.opened_window import OpenedWindow

opened = OpenedWindow(sys.argv[1], None, 64, Path(sys.argv[2]))
flight, window, wait = opened.flight, opened.window, opened.wait
page = opened.page
frames = opened.arrived_s
opened.start()
chance = random.Random(1)
view, middle = page.picture, QPoint(200, 200)
begun, references, counted = time.monotonic(), None, 0
while time.monotonic() < begun + SECONDS:
    assert flight.error is None, flight.error
    angle = chance.uniform(0.0, 2.0 * math.pi)
    stroke = QPoint(round(60 * math.cos(angle)), round(60 * math.sin(angle)))
    left, right = Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton
    button = chance.choice((left, left, left, left, right))
    QTest.mousePress(view, button, pos=middle)
    for step in range(1, 6):
        QTest.mouseMove(view, middle + stroke * step / 5)
        wait(10)
    QTest.mouseRelease(view, button, pos=middle + stroke)
    at = QPointF(middle)
    turn = QPoint(0, chance.choice((-120, 120, 120)))
    none, up = Qt.MouseButton.NoButton, Qt.ScrollPhase.NoScrollPhase
    calm = Qt.KeyboardModifier.NoModifier
    wheel = QWheelEvent(at, view.mapToGlobal(at), QPoint(), turn, none, calm, up, False)
    opened.application.sendEvent(view, wheel)
    wait(10)
    if references is None and time.monotonic() > begun + 10.0:
        references, counted = sys.getrefcount(None), len(frames)
lost = references - sys.getrefcount(None)
# To the last: the flight neither stopped nor froze.
assert max(b - a for a, b in zip(frames, frames[1:])) < 20.0
QTest.keyClick(page, Qt.Key.Key_Q)
QTest.keyClick(page, Qt.Key.Key_Return)
ending = time.monotonic()
while page.picture._result is None and time.monotonic() < ending + 60.0:
    wait(20)
score = flight.flight.result.score
QTest.keyClick(page, Qt.Key.Key_Q)
assert not window.isVisible()
assert flight.stop(60.0)
window.release()
flown = frames[-1] - frames[0]
print(flown, score.duration_s, score.path_length_mm, len(frames) - counted, lost)
"""


def test_the_window_lives_through_minutes_of_mouse_flight(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    script = FLY.replace("SECONDS", str(FLOWN_S))
    said = run_script(script, coarse_scenario, tmp_path / "f.paravol", limit_s=850.0)
    seconds, scored_s, way_mm, frames, lost = map(float, said.split())
    assert seconds > 180.0
    # a busy machine steers the scope more slowly than the hand
    assert scored_s > 20.0
    assert way_mm > 100.0
    assert frames > 200
    if sys.version_info < (3, 12):
        # afterwards None is immortal, and its count tells nothing
        assert lost < NOISE
