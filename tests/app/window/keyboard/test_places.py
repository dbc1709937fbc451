"""Keys of other keyboards, as a server of X11 sends them, in the page of a flight.

They go in by `xdotool`, as from a keyboard; the test runs where that is installed.
"""

import shutil

import pytest

from tests.app.window.opened_window import run_script

pytestmark = pytest.mark.display

PRESS = """
import os, subprocess, sys, time
from PySide6.QtWidgets import QApplication
from app.window.keyboard.actions import Act
from app.window.main_window import MainWindow
from devices.controls.steering import Axis
from tests.app.window.flight.test_flight_page import opened

layout, expected = sys.argv[1:3]
application = QApplication([])
# not before: a server whose last client goes forgets it
subprocess.run(["setxkbmap", layout], check=True)
application.processEvents()
window, page = MainWindow(), opened()
window.show_page(page)
window.show()
held, pressed = [], []

class Steering:
    def hold(self, axis, rate, at_s):
        held.append((axis, rate))

    def press(self, button, is_down, at_s):
        pressed.append((button, is_down))

page._flight.order.input.controls.steering = Steering()
hand = page._flight.hand
works = []
hand.work = works.append
CODES = {"W": 25, "A": 38, "B": 56, "T": 28, "Q": 24, "1": 10}

def until(holds):
    began = time.monotonic()
    while not holds():
        application.processEvents()
        assert time.monotonic() - began < 60.0, (held, page.picture._message)
        time.sleep(0.01)

def send(what, place):
    subprocess.run(["xdotool", what, str(CODES[place])], check=True)

until(window.isVisible)
subprocess.run(["xdotool", "windowfocus", str(int(window.winId()))], check=True)
until(window.isActiveWindow)
for place, axis, rate in (("W", Axis.INSERT, 1.0), ("A", Axis.ROLL, -1.0)):
    send("keydown", place)
    until(lambda: held)
    assert held.pop() == (axis, rate), held
    send("keyup", place)
    until(lambda: held)
    assert held.pop() == (axis, 0.0), held
send("key", "1")
until(lambda: len(pressed) == 2)
assert pressed == [(1, True), (1, False)]
send("key", "B")
until(lambda: works == [True, False])
send("key", "T")
until(lambda: hand.tool)
if len(sys.argv) > 3:
    page.switch_help()
    application.processEvents()
    window.grab().save(sys.argv[3])
    page.switch_help()
acts = Act.MOVE_IN, Act.MOVE_OUT, Act.TURN_LEFT, Act.TURN_RIGHT
buttons = [page._actions.bar.button(act) for act in acts]
shown = "".join(button.text().splitlines()[-1] for button in buttons)
assert shown == expected, shown
page._is_under_way = True
send("key", "Q")
until(lambda: page._notices.is_asking)
page.release()
window.shut()
"""

PRINTED = {
    **{"us": "WSAD", "fr": "ZSQD", "ru": "ЦЫФВ", "gr": "\u03c2\u03a3\u0391\u0394"},
    **{"il": "'דשג", "ara": "صسشي"},
}


@pytest.mark.parametrize(
    "layout",
    [n if n == "fr" else pytest.param(n, marks=pytest.mark.slow) for n in PRINTED],
)
def test_a_flight_is_steered_on_every_keyboard(layout: str, screen: str) -> None:
    if shutil.which("xdotool") is None:
        pytest.skip("there is no xdotool")
    run_script(PRESS, layout, PRINTED[layout], limit_s=120.0)
