"""Points of a look are moved by mouse and keys, and never change their order."""

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.volume.transfer_editor import TransferEditor
from paravol.volume.look import VolumeLook, check
from paravol.volume.presets import presets
from paravol.volume.scan import Scan
from renderers.scene import Volume

Key, Left = Qt.Key, Qt.MouseButton.LeftButton


@pytest.fixture
def shown(application: QApplication) -> tuple[TransferEditor, list[VolumeLook]]:
    values = np.linspace(-1000, 1500, 1000, dtype=np.float32).reshape(10, 10, 10)
    scan = Scan.of("ct", Volume(values, np.ones(3), np.zeros(3)))
    editor = TransferEditor()
    editor.resize(400, 200)
    edits: list[VolumeLook] = []
    editor.edited.connect(edits.append)
    editor.show_look(scan, presets(scan)[0])
    edits.append(presets(scan)[0])
    return editor, edits


def place(editor: TransferEditor, look: VolumeLook, number: int) -> QPoint:
    return editor.place_of(look.points[number]).toPoint()


def drag(editor: TransferEditor, begin: QPoint, end: QPoint) -> None:
    QTest.mousePress(editor, Left, pos=begin)
    QTest.mouseMove(editor, end)
    QTest.mouseRelease(editor, Left, pos=end)


def test_a_dragged_point_goes_where_the_mouse_goes(
    shown: tuple[TransferEditor, list[VolumeLook]],
) -> None:
    editor, edits = shown
    begin = place(editor, edits[0], 2)
    drag(editor, begin, begin + QPoint(10, 40))
    assert editor.selected == 2
    assert (place(editor, edits[-1], 2) - begin - QPoint(10, 40)).manhattanLength() <= 2
    assert edits[-1].points[:2] == edits[0].points[:2]


def test_a_point_stops_at_its_neighbours_and_at_the_edges(
    shown: tuple[TransferEditor, list[VolumeLook]],
) -> None:
    editor, edits = shown
    for far in (QPoint(-1000, 1000), QPoint(5000, -1000)):
        drag(editor, place(editor, edits[-1], 1), far)
        check(edits[-1])
        densities = [point.density for point in edits[-1].points]
        assert densities == sorted(densities)


def test_a_double_click_adds_and_delete_removes(
    shown: tuple[TransferEditor, list[VolumeLook]],
) -> None:
    editor, edits = shown
    QTest.mouseDClick(editor, Left, pos=QPoint(60, 60))
    assert len(list(edits[-1].points)) == 5
    assert editor.selected == 0
    for _ in range(6):
        QTest.keyClick(editor, Key.Key_Delete)
    assert len(list(edits[-1].points)) == 2  # fewer make no line
    check(edits[-1])


def test_keys_choose_and_move_a_point(
    shown: tuple[TransferEditor, list[VolumeLook]],
) -> None:
    editor, edits = shown
    QTest.keyClick(editor, Key.Key_N)
    QTest.keyClick(editor, Key.Key_P)
    QTest.keyClick(editor, Key.Key_P)
    chosen: int = editor.selected
    assert chosen == 3
    before = edits[-1].points[3]
    QTest.keyClick(editor, Key.Key_Down)
    QTest.keyClick(editor, Key.Key_Left, Qt.KeyboardModifier.ShiftModifier)
    after = edits[-1].points[3]
    assert after.opacity == pytest.approx(before.opacity - 0.02)
    assert 0 < before.density - after.density < 20
    editor.recolour("#123456")
    assert edits[-1].points[3].colour == "#123456"
    assert not editor.grab().isNull()
