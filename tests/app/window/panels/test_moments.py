"""Moments kept in the window grow side by side, are saved, and can be enlarged."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.panels.moments import MOST_MOMENTS, MomentView
from paravol.snapshots.snapshot_queue import MomentPicture
from tests.app.window.opened_window import run_script

LIMIT_S = 280.0

KEEP = """
import sys
from pathlib import Path
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from paravol.snapshots.snapshot_queue import MomentPicture
from tests.app.window.opened_window import OpenedWindow

size, record = int(sys.argv[2]), Path(sys.argv[3])
opened = OpenedWindow(sys.argv[1], size=size, record=record)
flight, window, until = opened.flight, opened.window, opened.until
page = opened.page
frames = opened.arrived_s
def pictures():
    return [event for event in opened.told if isinstance(event, MomentPicture)]
opened.start()
assert not page._moments.isVisible()
QTest.keyClick(page, Qt.Key.Key_Space)
until("something to see", lambda: any(t.pixels is not None for t in pictures()))
window.grab().save(sys.argv[4])
before = len(frames)
until("the end", lambda: pictures()[-1].done is None)
window.grab().save(sys.argv[5])
until("live frames", lambda: len(frames) > before)
print(page._moments.caption)
opened.close()
"""


@pytest.mark.display
@pytest.mark.slow
def test_a_kept_moment_grows_and_is_saved(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    record = tmp_path / "flight.paravol"
    shots = tmp_path / "growing.png", tmp_path / "saved.png"
    said = run_script(KEEP, coarse_scenario, 256, record, *shots, limit_s=LIMIT_S)
    (file,) = (record / "snapshots").iterdir()
    assert file.name in said
    with Image.open(file) as picture:
        saved = np.asarray(picture)
    assert saved.shape == (256, 256, 3)
    assert saved.std() > 5
    growing, final = (np.asarray(Image.open(shot).convert("RGB")) for shot in shots)
    assert growing.shape == final.shape
    assert (growing != final).any()


def grey(code: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return np.full((32, 32, 3), code, np.uint8)


def shown(strip: MomentView, x: int, y: int) -> int:
    return strip.grab().toImage().pixelColor(x, y).red()


def test_moments_stand_side_by_side_the_newest_first(application: QApplication) -> None:
    strip = MomentView()
    strip.resize(300, strip.height())
    assert strip.isHidden()
    strip.show_moment(MomentPicture(1.0, grey(60), 0.5))
    strip.show_moment(MomentPicture(2.0, grey(200), 0.1))
    assert not strip.isHidden()
    assert strip.times_s == [2.0, 1.0]
    assert (shown(strip, 30, 30), shown(strip, 130, 30)) == (200, 60)
    # a message without a picture leaves what was there, at its place
    strip.show_moment(MomentPicture(1.0, None, 0.8))
    assert (shown(strip, 30, 30), shown(strip, 130, 30)) == (200, 60)
    strip.show_moment(MomentPicture(2.0, grey(201), None, "a/moment.png", 3.25))
    title, detail = strip.caption
    assert title == "Moment at 2.0 s"
    assert detail == "saved as snapshots/moment.png · live picture off by 3.2 of 255"


def test_a_click_enlarges_a_moment_that_goes_on_growing(
    application: QApplication,
) -> None:
    strip = MomentView()
    strip.resize(300, strip.height())
    for n in (1, 2):
        strip.show_moment(MomentPicture(float(n), grey(50 * n), 0.5))
    QTest.mouseClick(strip, Qt.MouseButton.LeftButton, pos=QPoint(130, 30))
    large = strip.enlarged
    assert large is not None
    middle = large.rect().center()

    def seen() -> int:
        return large.grab().toImage().pixelColor(middle).red()

    assert (large.windowTitle(), seen()) == ("Moment at 1.0 s", 50)
    strip.show_moment(MomentPicture(1.0, grey(90), 0.9))
    assert seen() == 90
    # the arrows go round the strip
    for _ in range(2):
        QTest.keyClick(large, Qt.Key.Key_Right)
        assert large.isVisible()
    assert large.windowTitle() == "Moment at 1.0 s"
    QTest.keyClick(large, Qt.Key.Key_Left)
    assert (large.windowTitle(), seen()) == ("Moment at 2.0 s", 100)
    QTest.keyClick(large, Qt.Key.Key_Escape)
    assert not large.isVisible()


def test_only_so_many_moments_are_held(application: QApplication) -> None:
    strip = MomentView()
    for n in range(MOST_MOMENTS + 3):
        strip.show_moment(MomentPicture(float(n), grey(n), None, "m.png"))
    assert strip.times_s == [float(n) for n in reversed(range(3, MOST_MOMENTS + 3))]
