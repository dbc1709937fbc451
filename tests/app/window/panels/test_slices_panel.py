"""The slices in the window, painted without a screen."""

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QImage, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from anatomy.scan.histogram import Peaks, transfer_of
from app.window.panels.slices_panel import (
    GAP_PX,
    HEIGHT_PX,
    HU_PER_PIXEL,
    MARK,
    PLACE_MARK,
    SHOWN_MM,
    SlicesView,
)
from paravol.slices.slice_views import GRAY_WINDOWS, Plane, SliceViews
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


AXES = {Plane.AXIAL: (0, 1), Plane.CORONAL: (0, 2), Plane.SAGITTAL: (1, 2)}
"""What goes to the right and down, or up, in each plane: x, y or z of the patient."""

CLICKED = (20, -10)
"""Pixels beside a slice's middle."""


def spot(plane: Plane, right: int, down: int) -> QPoint:
    number = list(Plane).index(plane)
    left = number * (EDGE + GAP_PX)
    return QPoint(left + EDGE // 2 + right, EDGE // 2 + down)


@pytest.mark.parametrize("plane", Plane)
def test_a_click_looks_the_place_up_in_all_three(
    application: QApplication, plane: Plane
) -> None:
    view = shown(head(mr=False))
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=spot(plane, *CLICKED))
    across, down = AXES[plane]
    per_pixel = SHOWN_MM / EDGE
    expected = np.zeros(3)
    expected[across] = CLICKED[0] * per_pixel
    # up in the picture is up in the patient, or to the front
    expected[down] = CLICKED[1] * per_pixel * (1 if plane is Plane.AXIAL else -1)
    assert view.place_mm == pytest.approx(expected, abs=0.01)
    # the mark is below the mouse, and the same place is marked in the other slices
    pixels = painted(view).astype(int)
    mark = QColor(PLACE_MARK)
    close = np.abs(pixels - (mark.red(), mark.green(), mark.blue())).sum(axis=2) < 90
    for each in Plane:
        right, low = expected[list(AXES[each])] / per_pixel
        at = spot(each, round(right), round(low if each is Plane.AXIAL else -low))
        around = close[at.y() - 9 : at.y() + 10, at.x() - 9 : at.x() + 10]
        assert around.sum() > 8, each
    # the scope's own cross stays where the scope is, while the place is looked at
    view.follow(np.array([1.0, 0.0, 0.0]))
    assert view.place_mm == pytest.approx(expected, abs=0.01)
    assert "follows" not in view.info
    QTest.mouseDClick(view, Qt.MouseButton.LeftButton, pos=spot(plane, 0, 0))
    assert "follows" in view.info
    view.follow(np.array([2.0, 0.0, 0.0]))
    assert "follows" in view.info


def test_left_of_the_patient_is_told_as_left(application: QApplication) -> None:
    """An asymmetric head: what lies under a click on L is the bone on the left."""
    view = shown(head(mr=False))
    for plane in (Plane.AXIAL, Plane.CORONAL):
        # in front and above; letters stand at the rims of the slices
        QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=spot(plane, 40, -12))
        place = view.place_mm
        assert place is not None
        assert place[0] > 15.0
        assert "L 1" in view.info
        view.follow_again()
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=spot(Plane.AXIAL, 40, -12))
    assert view.info.endswith("1600 HU")
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=spot(Plane.AXIAL, -40, -12))
    assert view.info.endswith("40 HU")


def test_wheel_and_keys_go_through_slices_and_stay_in_the_head(
    application: QApplication,
) -> None:
    view = shown(head(mr=False))

    def wheel(plane: Plane, notches: int) -> None:
        at = QPointF(spot(plane, 0, 0))
        turned = QPoint(0, 120 * notches)
        none = Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier
        phase = Qt.ScrollPhase.NoScrollPhase
        view.wheelEvent(QWheelEvent(at, at, QPoint(), turned, *none, phase, False))

    for number, plane in enumerate(Plane):
        view.follow_again()
        wheel(plane, 3)
        place = view.place_mm
        assert place is not None
        assert place[2 - number] == pytest.approx(3.0)
        wheel(plane, -3)
        assert view.place_mm == pytest.approx(np.zeros(3))
    wheel(Plane.AXIAL, 1000)
    view.nudge(1000, 0)
    assert view.place_mm == pytest.approx([29.0, 0.0, 29.0])
    assert view.next_plane() == "Coronal"
    view.step(-1)
    assert view.place_mm == pytest.approx([29.0, -1.0, 29.0])
    assert view.switch_following() == "The slices follow the scope"
    assert view.place_mm is None


def test_the_window_is_chosen_or_dragged_and_told(application: QApplication) -> None:
    view = shown(head(mr=False))
    texts = {GRAY_WINDOWS[0].text(): view.info}
    for _ in GRAY_WINDOWS[1:]:
        assert "HU" in view.next_window()
        texts[view.window_hu.text()] = view.info
    assert {"bone 2000/350", "soft tissue 350/40"} < set(texts)
    assert all(text in info for text, info in texts.items())
    # soft tissue at 40 HU is then the middle of its window
    front, right = EDGE // 4, EDGE // 2 - 30
    assert abs(int(painted(view)[front, right, 0]) - 128) <= 1
    right_button = Qt.MouseButton.RightButton
    QTest.mousePress(view, right_button, pos=QPoint(50, 50))
    QTest.mouseMove(view, QPoint(60, 45))
    QTest.mouseRelease(view, right_button, pos=QPoint(60, 45))
    assert view.window_hu.width == pytest.approx(350.0 + 10 * HU_PER_PIXEL)
    assert view.window_hu.level == pytest.approx(40.0 - 5 * HU_PER_PIXEL)
    assert painted(view)[front, right, 0] > 128
    assert "own" in view.info
    assert view.place_mm is None
