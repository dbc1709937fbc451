"""The scope's picture on a second screen: Qt's off-screen platform has two."""

import json
from pathlib import Path

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from tests.app.window.opened_window import run_script

MIRROR = """
import json, os, sys
os.environ["QT_QPA_PLATFORM"] = "offscreen:configfile=" + sys.argv[1]
import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from app.window.flight.scope_screen import ScopeScreen
from app.window.panels.endoscope_panel import PictureView

application = QApplication([])
keys = []
class Page(QWidget):
    def keyPressEvent(self, event):
        keys.append(event.key() == Qt.Key.Key_W)

page, picture = Page(), PictureView()
page.setScreen(application.screens()[0])
page.move(application.screens()[0].geometry().topLeft())
page.show()
window = ScopeScreen(picture, page)
closed = []
window.closed.connect(lambda: closed.append(True))
told = window.fill()
pixels = np.zeros((64, 64, 3), np.uint8)
pixels[:, 32:] = (200, 100, 50)  # brighter on the right: a mirrored picture is told

def grabbed():
    application.processEvents()
    image = window.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    row = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    shape = image.height(), image.width(), 3
    return row[:, : 3 * image.width()].reshape(shape).astype(int)

picture.show_picture(pixels)
shown = grabbed()
height, width = shown.shape[:2]
picture.warn("not live")
picture.say("The device is away", "Check plugs and power.")
warned = grabbed()
QTest.keyClick(window, Qt.Key.Key_W)
QTest.keyClick(window, Qt.Key.Key_Escape)
print(json.dumps({
    "told": told,
    "geometry": [window.x(), window.y(), window.width(), window.height()],
    "frame": bool(window.windowFlags() & Qt.WindowType.FramelessWindowHint),
    "left": shown[height // 2, width // 2 - height // 4].tolist(),
    "right": shown[height // 2, width // 2 + height // 4].tolist(),
    "corner": shown[5, 5].tolist(),
    "changed": float((np.abs(warned - shown).max(axis=2) > 30).mean()),
    "keys": keys,
    "closed": closed,
}))
"""


@pytest.mark.parametrize("screens", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_it_fills_the_other_screen_and_mirrors_the_picture(
    screens: int, tmp_path: Path
) -> None:
    places = [(0, 0, 800, 600), (800, 0, 1280, 720)][:screens]
    configured = [
        {
            "name": f"screen {number}",
            **dict(zip(("x", "y", "width", "height"), place, strict=True)),
            "logicalDpi": 96,
            "logicalBaseDpi": 96,
            "dpr": 1,
        }
        for number, place in enumerate(places)
    ]
    file = tmp_path / "screens.json"
    file.write_text(json.dumps({"screens": configured}))
    found = json.loads(run_script(MIRROR, file, limit_s=60.0))
    assert tuple(found["geometry"]) == places[-1]
    assert ("one screen only" in found["told"]) == (screens == 1)
    assert found["frame"]
    assert found["left"] == [0, 0, 0]
    assert found["right"] == [200, 100, 50]
    assert found["corner"] == [0, 0, 0]
    assert found["changed"] > 0.02
    assert found["keys"] == [True]
    assert found["closed"] == [True]
