"""Painting the window over and over takes nothing from the interpreter.

PySide6 6.12.0 loses a reference to None in most calls of QPainter. On Python 3.11 the
last one ends the process, after a minute or two of flight.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

ROOT = Path(__file__).parents[4]

NOISE = 50
"""References that come and go by themselves; a loss in every call is a thousand
times as much: the three widgets make about a hundred calls a round."""

PAINT = """
import sys
from pathlib import Path
import numpy as np
from PySide6.QtCore import QPoint
from PySide6.QtGui import QImage, QPainter
from PySide6.QtWidgets import QApplication
from anatomy.scan.histogram import Peaks, transfer_of
from paravol.flight.flight_events import FlightEnd
from paravol.guide import GuideMark, NameMark
from paravol.slices.slice_views import SliceViews
from paravol.snapshots.snapshot_queue import MomentPicture
from app.window.panels.moments import MomentView
from app.window.panels.endoscope_panel import PictureView
from app.window.panels.slices_panel import SlicesView
from app.window.panels.touch_bars import TouchBars
from paravol.feedback import TouchSigns
from paravol.feedback.hazard_pointer import HazardPointer
from renderers.scene import Volume
from scenarios import Score

application = QApplication([])
pixels = np.full((64, 64, 3), 90, np.uint8)
picture = PictureView()
picture.show_picture(pixels)
picture.warn("pressing: septum")
touching = PictureView()
touching.warn("", "septum")
touching.point_at(HazardPointer((0.4, 0.5), (0.7, 0.4)), "1.0 mm to orbit", "#e69f00")
bars = TouchBars()
bars.show_signs(TouchSigns(5.6, "lamina papyracea", 6.13, ("orbit", 0.6)), "no sound")
picture.say("Touch the nasion", "Hold the stylus on it.", 0.5)
picture.mark_recording(True)
names = NameMark("septum", 0.5, 0.5), NameMark("choana", 0.7, 0.3)
guided = [PictureView() for _ in range(3)]
for view, x, is_goal in zip(guided, (0.6, 0.6, 1.4), (True, False, True)):
    view.show_picture(pixels)
    way = GuideMark("choana, right", np.zeros(3), 12.0, x, 0.4, is_goal, 0.5)
    view.guide_to(way, names)
picture.show_result(FlightEnd("The flight is over", Score(1.0, 2.0, 3.0, 0, {})))
moment = MomentView()
moment.show_moment(MomentPicture(1.0, pixels, 0.5))
slices = SlicesView()
ct = Volume(np.full((30, 30, 30), 40, np.int16), np.ones(3), np.zeros(3))
slices.show_head(SliceViews.of({"ct": ct}, transfer_of(Peaks(-1000, 40, 15, 700))))
views = picture, touching, bars, moment, slices, *guided
canvas = QImage(240, 240, QImage.Format.Format_RGB32)
for view in views:
    view.resize(240, 120)

def paint(rounds):
    for _ in range(rounds):
        for view in views:
            view.render(canvas, QPoint())

paint(20)
before = sys.getrefcount(None)
paint(ROUNDS)
print(before - sys.getrefcount(None))
"""


@pytest.mark.slow
@pytest.mark.display
@pytest.mark.skipif(
    sys.version_info >= (3, 12),
    reason="None is immortal from Python 3.12 on: its count stands still whatever is "
    "lost, and a loss does no harm",
)
def test_ten_thousands_of_calls_lose_no_reference_to_none() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PAINT.replace("ROUNDS", "500")],
        cwd=ROOT,
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        timeout=240.0,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert int(done.stdout) < NOISE
