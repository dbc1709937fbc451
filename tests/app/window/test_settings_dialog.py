"""Settings are shown at once, kept on OK and taken back on Cancel."""

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from app.window.main_window import MainWindow
from app.window.page import Page
from app.window.settings_dialog import SettingsDialog
from app.window.style import BACKGROUND
from app.window.themes import DARK, LIGHT, THEMES
from paravol.window_preferences import (
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
