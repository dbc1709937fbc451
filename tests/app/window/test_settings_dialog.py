"""Settings are shown at once, kept on OK and taken back on Cancel."""

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.main_window import MainWindow
from app.window.page import Page
from app.window.settings_dialog import SettingsDialog
from app.window.style import BACKGROUND
from app.window.themes import DARK, LIGHT, THEMES
from devices.controls.keyboard import Feel
from paravol.trainee.window_preferences import (
    WindowPreferences,
    preferences_file,
    read_preferences,
)


class ScaledPage(Page):
    scale = 0.0

    def set_scale(self, scale: float) -> None:
        self.scale = scale


def test_choices_show_at_once_and_are_kept_or_taken_back(
    application: QApplication,
) -> None:
    window, page = MainWindow(), ScaledPage()
    window.show_page(page)
    first = page.scale
    for answer, expected in (
        (Qt.Key.Key_Escape, WindowPreferences()),
        (Qt.Key.Key_Return, WindowPreferences(LIGHT, 1.2)),
    ):
        QTest.keyClick(page, Qt.Key.Key_F2)
        dialog = window.findChild(SettingsDialog)
        assert isinstance(dialog, SettingsDialog)
        dialog.theme.setCurrentText("Light")
        dialog.texts.setCurrentText("120%")
        assert THEMES[LIGHT].background == BACKGROUND.name()
        assert page.scale == pytest.approx(1.2 * first)
        QTest.keyClick(dialog, answer)
        application.sendPostedEvents()
        application.processEvents()
        assert THEMES[expected.theme].background == BACKGROUND.name()
        assert page.scale == pytest.approx(expected.font_scale * first)
        assert read_preferences() == expected
    window.take_preferences(WindowPreferences("of another version"))
    assert THEMES[DARK].background == BACKGROUND.name()
    window.shut()
    preferences_file().unlink()


def test_a_key_is_changed_and_told_and_kept_or_taken_back(
    application: QApplication,
) -> None:
    window, page = MainWindow(), ScaledPage()
    window.show_page(page)
    for answer, expected in (
        (Qt.Key.Key_Escape, {}),
        (Qt.Key.Key_Return, {"move in": "@X", "hint": "Ctrl+@G", "work": "@M"}),
    ):
        QTest.keyClick(page, Qt.Key.Key_F2)
        dialog = window.findChild(SettingsDialog)
        assert isinstance(dialog, SettingsDialog)
        dialog.tabs.setCurrentIndex(2)
        ctrl = Qt.KeyboardModifier.ControlModifier
        give(dialog, Act.MOVE_IN, Qt.Key.Key_X)
        assert dialog.told.text() == ""
        give(dialog, Act.HINT, Qt.Key.Key_G, ctrl)
        give(dialog, Act.WORK, Qt.Key.Key_M)
        told = "The two have changed places. Shows CT, MR or both: B."
        assert dialog.told.text() == told
        give(dialog, Act.SUCTION, Qt.Key.Key_Escape)
        assert dialog.told.text() == ""
        labels = KEYS.label(Act.MOVE_IN, Act.HINT, Act.WORK, Act.IMAGING)
        assert labels == "X Ctrl+G M B"
        assert dialog.keys._items[Act.MOVE_IN].text(1) == "X"
        QTest.keyClick(dialog, answer)
        application.sendPostedEvents()
        application.processEvents()
        kept = read_preferences().keys
        assert kept == (expected and {**expected, "imaging": "@B"})
        assert KEYS.label(Act.MOVE_IN) == ("X" if expected else "W")
    window.take_preferences(WindowPreferences())
    window.shut()
    preferences_file().unlink()


def give(
    dialog: SettingsDialog,
    act: Act,
    key: Qt.Key,
    mask: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier,
) -> None:
    """Choose an action, press Enter, then its new key."""
    table = dialog.keys
    table.setCurrentItem(table._items[act])
    QTest.keyClick(table, Qt.Key.Key_Return)
    assert "press a key" in table._items[act].text(1)
    QTest.keyClick(table, key, mask)


def turns(button: Qt.MouseButton) -> bool:
    return KEYS.turning_button is button


def test_the_left_hand_has_its_keys_and_buttons(application: QApplication) -> None:
    window, page = MainWindow(), ScaledPage()
    window.show_page(page)
    QTest.keyClick(page, Qt.Key.Key_F2)
    dialog = window.findChild(SettingsDialog)
    assert isinstance(dialog, SettingsDialog)
    dialog.left_handed.click()
    dialog.pitch.setChecked(True)
    dialog.mouse.setCurrentText("200%")
    assert turns(Qt.MouseButton.LeftButton)
    assert KEYS.label(Act.MOVE_IN) == "I"
    assert (KEYS.feel.drag, KEYS.feel.pitch, KEYS.feel.wheel) == (2.0, -1.0, 1.0)
    dialog.first_keys.click()
    assert turns(Qt.MouseButton.RightButton)
    assert KEYS.label(Act.MOVE_IN) == "W"
    dialog.reject()
    assert Feel() == KEYS.feel
    window.shut()
