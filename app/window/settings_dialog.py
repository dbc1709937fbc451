"""The choice of theme and size of texts, tried at once and kept."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QLabel,
    QWidget,
)

from app.window.themes import THEMES
from paravol.window_preferences import WindowPreferences

FONT_STEPS = (0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5)
"""To choose from, within `window_preferences.FONT_SCALES`."""


class SettingsDialog(QDialog):
    """Ask for the window's looks; what is chosen shows while it is open."""

    chosen = Signal(object)
    """`WindowPreferences`, whenever a choice changes; after Cancel the first ones."""

    def __init__(self, before: WindowPreferences, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Settings")
        self._before = before
        self.theme = QComboBox()
        self.theme.addItems([name.capitalize() for name in THEMES])
        self.theme.setCurrentIndex(list(THEMES).index(before.theme))
        self.theme.setAccessibleName("Theme")
        self.texts = QComboBox()
        self.texts.addItems([f"{scale:.0%}" for scale in FONT_STEPS])
        nearest = min(FONT_STEPS, key=lambda scale: abs(scale - before.font_scale))
        self.texts.setCurrentIndex(FONT_STEPS.index(nearest))
        self.texts.setAccessibleName("Size of texts")
        kinds = QDialogButtonBox.StandardButton
        buttons = QDialogButtonBox(kinds.Ok | kinds.Cancel)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        for button in buttons.buttons():
            button.setIcon(QIcon())  # the desktop's own fit no theme
        form = self._form = QFormLayout(self)
        form.setLabelAlignment(Qt.AlignmentFlag.AlignVCenter)
        theme, font = QLabel("&Theme"), QLabel("&Size of texts")
        theme.setBuddy(self.theme)
        font.setBuddy(self.texts)
        form.addRow(theme, self.theme)
        form.addRow(font, self.texts)
        form.addRow(buttons)
        self.theme.currentIndexChanged.connect(self._tell)
        self.texts.currentIndexChanged.connect(self._tell)

    def set_scale(self, scale: float) -> None:
        """Scale the layout; 1 is the designed size."""
        margin = round(16 * scale)
        self._form.setContentsMargins(margin, margin, margin, margin)
        self._form.setHorizontalSpacing(margin)
        self._form.setVerticalSpacing(round(10 * scale))
        for box in (self.theme, self.texts):
            box.setMinimumWidth(round(180 * scale))

    @property
    def preferences(self) -> WindowPreferences:
        """Return what is chosen now."""
        name = list(THEMES)[self.theme.currentIndex()]
        return WindowPreferences(name, FONT_STEPS[self.texts.currentIndex()])

    def _tell(self) -> None:
        self.chosen.emit(self.preferences)

    def reject(self) -> None:
        """Go back to what was before."""
        self.chosen.emit(self._before)
        super().reject()
