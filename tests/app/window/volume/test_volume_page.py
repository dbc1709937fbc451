"""A scan's page on a virtual screen: turned, drawn in each way, its look kept."""

from pathlib import Path

import pytest

from tests.app.window.opened_window import run_script

pytestmark = pytest.mark.display

BALL = """
import sys
from pathlib import Path
import numpy as np
from PySide6.QtCore import QEventLoop, QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment
prepare_environment()
from app.window.main_window import MainWindow
from app.window.volume.volume_page import VolumePage
from paravol.volume.scan import scans_of
from renderers.scene import Volume

folder = Path(sys.argv[1])
side = np.arange(32.0)
z, y, x = np.meshgrid(side, side, side, indexing="ij")
depth = 9.0 - np.sqrt((x - 20) ** 2 + (y - 15) ** 2 + (z - 12) ** 2)
ct = Volume(
    np.clip(1300 * (0.5 + depth / 2) - 1000, -1000, 600).astype("f4"),
    np.ones(3), np.zeros(3),
)
mr = ct.with_values(np.where(depth > 0, 300.0, 10.0).astype("f4"), 0.0)
"""

SCRIPT = (
    BALL
    + """
application = QApplication([])
window = MainWindow()
page = VolumePage("Ball", scans_of(ct, {"t1": mr}), 1)
drawn = []
page.drawing.drawn.connect(drawn.append)
window.show_page(page)
window.show()

def wait(what, holds):
    # kernels that are in no cache yet are compiled meanwhile
    for _ in range(10_000):
        if holds():
            return
        loop = QEventLoop()
        QTimer.singleShot(20, loop.quit)
        loop.exec()
    raise AssertionError(what)

def shown(do):
    # what is shown once nothing more comes
    count = len(drawn)
    do()
    wait("a picture", lambda: len(drawn) > count)
    wait("the last", lambda: page.drawing.is_idle)
    loop = QEventLoop(); QTimer.singleShot(50, loop.quit); loop.exec()
    pixels = drawn[-1].pixels.astype(int)
    ball = pixels.sum(axis=2) > 80
    return pixels, ball

pixels, ball = shown(lambda: page.controls.preset.setCurrentIndex(1))
page.controls.preset.setCurrentIndex(0)
splats, ball = shown(lambda: QTest.keyClick(page.picture, Qt.Key.Key_Right))
rays, ball_by_rays = shown(lambda: page.controls.method.setCurrentIndex(2))
assert rays.shape[:2] == splats.shape[:2]
surface, ball_by_surface = shown(lambda: page.controls.method.setCurrentIndex(4))
both = (ball_by_rays & ball_by_surface).sum() / (ball_by_rays | ball_by_surface).sum()
assert both > 0.9, both
# splats of a millimetre blur so small a ball, evenly
middles = [np.argwhere(seen).mean(axis=0) for seen in (ball, ball_by_rays)]
assert np.abs(middles[0] - middles[1]).max() < 3.0, middles
page.controls.method.setCurrentIndex(0)
turned, ball_turned = shown(lambda: QTest.keyClick(page.picture, Qt.Key.Key_Left))
page.keep_look(folder / "mine")
page.open_look(folder / "no such.json")
assert "no such.json" in page.picture._said
points = page.controls.look.points
page.controls.preset.setCurrentIndex(3)
page.open_look(folder / "mine.json")
assert page.controls.look.points == points
shown(lambda: page.controls.scan_box.setCurrentIndex(1))
assert page.controls.scan.title == "MR, T1"
window.shut()
window.release()
"""
)


@pytest.mark.slow
def test_a_scan_is_turned_edited_and_drawn_in_each_way(
    screen: str, tmp_path: Path
) -> None:
    run_script(SCRIPT, tmp_path)


FIRST = (
    BALL
    + """
import threading
from app.window.page import Page
from paravol.volume.volume_view import VolumeView
from tests.app.window.desk_run import waits_of_the_window

application = QApplication([])
is_wanted = threading.Event()
draw = VolumeView.draw
def slow(view, *words):
    # as on a machine that has never run the program
    is_wanted.wait(60.0)
    return draw(view, *words)
VolumeView.draw = slow
window = MainWindow()
def wait(what, holds):
    # kernels that are in no cache yet are compiled meanwhile
    for _ in range(10_000):
        if holds():
            return
        loop = QEventLoop()
        QTimer.singleShot(20, loop.quit)
        loop.exec()
    raise AssertionError(what)
def opened():
    page = VolumePage("Ball", scans_of(ct, {"t1": mr}), 1)
    page.drawing.drawn.connect(drawn.append)
    page.left.connect(lambda: window.show_page(Page()))
    window.show_page(page)
    return page
drawn = []
page = opened()
window.show()
# a desktop does this; here there is none
window.activateWindow()
wait("an active window", window.isActiveWindow)
wait("a rough picture", lambda: drawn)
assert drawn[0].splats is None
assert (drawn[0].pixels.astype(int).sum(axis=2) > 120).sum() > 500
wait("a stage", lambda: "volume is being made" in page.stage.text())
assert page.share.isVisible()
window.grab().save(str(folder / "first.png"))
# who leaves meanwhile need not wait for it
waits = waits_of_the_window(lambda: None)
QTest.keyClick(page.picture, Qt.Key.Key_Escape)
assert not isinstance(window.page, VolumePage) and not waits
page = opened()
is_wanted.set()
wait("the volume", lambda: drawn[-1].splats)
wait("an end", lambda: not page.share.isVisible() and page.stage.text() == "")
QTest.keyClick(page.picture, Qt.Key.Key_Q, Qt.KeyboardModifier.ControlModifier)
assert not window.isVisible()
window.release()
"""
)


def test_the_first_picture_is_rough_and_what_keeps_waiting_is_told(
    screen: str, tmp_path: Path
) -> None:
    run_script(FIRST, tmp_path)
