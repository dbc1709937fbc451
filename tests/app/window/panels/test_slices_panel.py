"""The slices in the window, painted without a screen."""

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from PySide6.QtGui import QColor, QImage
from PySide6.QtWidgets import QApplication

from anatomy.scan.histogram import Peaks, transfer_of
from app.window.panels.slices_panel import GAP_PX, HEIGHT_PX, MARK, SlicesView
from paravol.slice_views import SliceViews
from renderers.scene import Volume

EDGE = HEIGHT_PX
WIDTH = 3 * EDGE + 2 * GAP_PX


def head(*, mr: bool) -> SliceViews:
    """Soft tissue on the patient's right, bone on the left, air behind."""
    ct = np.full((60, 60, 60), 40, np.int16)
    ct[:, :, 30:] = 1600
    ct[:, 30:] = -1000
    spacing, origin = np.ones(3), np.full(3, -30.0)
    volumes = {"ct": Volume(ct, spacing, origin)}
    if mr:
        signal = np.where(ct == 40, 1.0, 0.0).astype(np.float32)
        volumes["t1"] = Volume(signal, spacing, origin, background=0.0)
    return SliceViews.of(volumes, transfer_of(Peaks(-1000, 40, 15, 700)))


def painted(view: SlicesView) -> NDArray[np.uint8]:
    image = view.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8)
    whole = rows.reshape(image.height(), image.bytesPerLine())
    pixels = whole[:, : 3 * image.width()].reshape(image.height(), image.width(), 3)
    # the memory goes with the image
    return pixels.copy()


def shown(views: SliceViews) -> SlicesView:
    view = SlicesView()
    view.resize(WIDTH, HEIGHT_PX)
    view.show_head(views)
    view.follow(np.zeros(3))
    return view


def test_the_tip_is_in_the_middle_and_left_is_on_the_right(
    application: QApplication,
) -> None:
    view = shown(head(mr=False))
    pixels = painted(view).astype(int)
    mark = QColor(MARK)
    for number in range(3):
        x = number * (EDGE + GAP_PX) + EDGE // 2
        near = pixels[EDGE // 2 - 10 : EDGE // 2 + 10, x - 10 : x + 10].reshape(-1, 3)
        away = np.abs(near - (mark.red(), mark.green(), mark.blue())).sum(axis=1)
        assert away.min() < 60
    # axial: in front of the tip bone is on the patient's left, air is behind
    front, behind = EDGE // 4, 3 * EDGE // 4
    assert pixels[front, EDGE // 2 + 30].min() > 240
    assert 90 < pixels[front, EDGE // 2 - 30].min() < 150
    assert pixels[behind, EDGE // 2 + 30].max() < 20
    # 20 mm to the left all is bone
    view.follow(np.array([20.0, 0.0, 0.0]))
    assert painted(view)[front, EDGE // 2 - 20].min() > 240


def test_the_switch_names_what_is_shown(application: QApplication) -> None:
    view = shown(head(mr=True))
    front, right, left = EDGE // 4, EDGE // 2 - 30, EDGE // 2 + 30
    assert view.switch() == "MR"
    assert painted(view)[front, left].max() < 20
    assert painted(view)[front, right].min() > 240
    assert view.switch() == "CT bone on MR"
    bone = painted(view)[front, left].astype(int)
    assert bone[0] > bone[2] > 100
    assert view.switch() == "CT"
    assert shown(head(mr=False)).switch() == "This head has one scan only"


def test_what_is_cut_shows_although_the_tip_rests(application: QApplication) -> None:
    """The volume is edited in place by its owner; the panel then has fresh slices."""
    values = np.full((60, 60, 60), 40, np.int16)
    ct = Volume(values, np.ones(3), np.full(3, -30.0))
    views = SliceViews.of({"ct": ct}, transfer_of(Peaks(-1000, 40, 15, 700)))
    view = shown(views)
    before = painted(view)
    values[26:34, 26:34, 26:34] = -1000
    view.follow(np.zeros(3))
    assert np.array_equal(painted(view), before)
    view.refresh()
    view.follow(np.zeros(3))
    after = painted(view)
    assert np.array_equal(after, painted(shown(views)))
    assert not np.array_equal(after, before)
