"""Bars of force and nearness, painted; keys of the sound, pressed."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

ROOT = Path(__file__).parents[2]

BARS = """
import json
import numpy as np
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication
from app.window.panels.touch_bars import TouchBars
from paravol.feedback import TouchSigns

application = QApplication([])
WIDTH = 842  # two bars of 400 pixels and three sides of 14

def painted(signs, sound=""):
    bars = TouchBars()
    bars.resize(WIDTH, 52)
    bars.show_signs(signs, sound)
    image = bars.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    data = np.frombuffer(image.constBits(), np.uint8)
    pixels = data.reshape(image.height(), image.bytesPerLine())[:, : 3 * WIDTH]
    return pixels.reshape(image.height(), WIDTH, 3).astype(int), bars.accessibleName()

empty, _ = painted(TouchSigns())
found = {"full": [], "mark": [], "looks": []}
for force in (2.5, 5.0, 7.5, 12.5):
    pixels, _ = painted(TouchSigns(force, "mucosa"))
    changed = np.abs(pixels - empty).max(axis=2)[31:41, 14:414].max(axis=0) > 20
    found["full"].append(int(np.flatnonzero(changed).max()) + 1)
for limit in (6.0, 12.0):
    pixels, _ = painted(TouchSigns(0.0, "", limit))
    changed = np.abs(pixels - empty).max(axis=2)[44:48, 14:414].max(axis=0) > 60
    at = np.flatnonzero(changed)
    found["mark"].append(float(at.mean()) + 0.5)
# without colour the looks still differ: their grey varies along a hatched bar
for force in (2.0, 4.0, 5.8):
    pixels, _ = painted(TouchSigns(force, "lamella", 6.1))
    grey = pixels[31:41, 16 : 14 + int(force * 20) - 4].mean(axis=2)
    found["looks"].append([float(grey.mean()), float(grey.std())])
_, found["said"] = painted(TouchSigns(3.0, "lamella", 6.1, ("orbit", 1.24)))
quiet, _ = painted(TouchSigns(hazard=("orbit", 1.24)))
told, _ = painted(TouchSigns(hazard=("orbit", 1.24)), "no sound")
found["captioned"] = bool((quiet != told).any())
print(json.dumps(found))
"""

KEYS = """
import json
from PySide6.QtCore import QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from app.window.flight.sound_keys import SoundKeys
from paravol.feedback import SoundPlayer

application = QApplication([])
window, said = QWidget(), []

def refuse():
    raise OSError("nothing")

sound = SoundPlayer(is_on=False, open_device=refuse)
keys = SoundKeys(sound, window, lambda what, why: said.append([what, why]))
window.show()
states = [keys.caption]
for key in (Qt.Key.Key_U, Qt.Key.Key_Minus, Qt.Key.Key_Minus, Qt.Key.Key_Plus):
    QTest.keyClick(window, key)
states += [keys.caption, sound.is_on, sound.volume]
keys.fail("No sound: this machine has no loudspeaker.")
states.append(keys.caption)
QTest.keyClick(window, Qt.Key.Key_U)
QTest.keyClick(window, Qt.Key.Key_W)
print(json.dumps([states, said]))
"""


def run(script: str) -> Any:
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=ROOT,
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        timeout=120.0,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads(done.stdout)


@pytest.mark.display
def test_a_bar_is_as_long_as_the_force_and_marks_the_break() -> None:
    found = run(BARS)
    # 400 pixels for 20 N
    assert found["full"] == pytest.approx([50, 100, 150, 250], abs=1)
    assert found["mark"] == pytest.approx([120, 240], abs=1)
    (low, plain), (high, hatched), (breaking, crossed) = found["looks"]
    assert plain < 5 < 15 < hatched
    assert crossed > 15
    assert len({round(low), round(high), round(breaking)}) == 3
    assert found["said"] == "Force 3.0 of 6.1 N, lamella. Hazard 1.2 mm to orbit."
    assert found["captioned"]


@pytest.mark.display
def test_keys_switch_the_sound_and_say_so() -> None:
    states, said = run(KEYS)
    assert states == ["sound off", "", True, pytest.approx(0.9), "no sound"]
    assert [what for what, _ in said] == [
        "Sound on",
        "Volume 90%",
        "Volume 80%",
        "Volume 90%",
        "No sound",
        "No sound",
    ]
    assert said[-1][1] == "this machine has no loudspeaker."
