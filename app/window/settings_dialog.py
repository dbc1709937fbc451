"""The choice of looks, mouse and keys, tried at once and kept."""

import msgspec
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QHBoxLayout,
    QPushButton,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from app.window.keyboard.actions import LEFT_HANDED
from app.window.keyboard.key_table import KeyTable
from app.window.plain_label import PlainLabel
from app.window.scaling import hold, lay
from app.window.texts import LANGUAGES, tr
from app.window.themes import THEMES
from paravol.trainee.window_preferences import WindowPreferences

FONT_STEPS = (0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5)
"""To choose from, within `window_preferences.FONT_SCALES`."""

SPEED_STEPS = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)
"""As much, within `window_preferences.SPEEDS`."""


class SettingsDialog(QDialog):
    """Ask for looks, mouse and keys; what is chosen holds while it is open."""

    chosen = Signal(object)
    """`WindowPreferences`, whenever a choice changes; after Cancel the first ones."""

    def __init__(self, before: WindowPreferences, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(tr("Settings"))
        self._before = before
        self.theme = QComboBox()
        self.theme.addItems([tr(name.capitalize()) for name in THEMES])
        self.theme.setCurrentIndex(list(THEMES).index(before.theme))
        self.language = QComboBox()
        self.language.addItems([tr("As the system"), *LANGUAGES.values()])
        codes = ["", *LANGUAGES]
        if before.language in codes:
            self.language.setCurrentIndex(codes.index(before.language))
        self.texts = _steps(FONT_STEPS, before.font_scale)
        self.mouse = _steps(SPEED_STEPS, before.mouse_speed)
        self.wheel = _steps(SPEED_STEPS, before.wheel_speed)
        slower = [speed for speed in SPEED_STEPS if speed <= 1.0]
        self.pace = _steps(slower, before.key_speed)
        self.pitch = QCheckBox(tr("Dragging &up tilts down"))
        self.turned_wheel = QCheckBox(tr("The wheel turned &away draws back"))
        self.swapped = QCheckBox(tr("Left &button turns the post, right one tilts"))
        for box, is_on in (
            (self.pitch, before.inverts_pitch),
            (self.turned_wheel, before.inverts_wheel),
            (self.swapped, before.swaps_buttons),
        ):
            box.setChecked(is_on)
            box.toggled.connect(self._tell)
        self.keys = KeyTable(before.keys, self)
        hold(self.keys, setMinimumWidth=500, setMinimumHeight=320)
        self.keys.chosen.connect(self._tell)
        self.told = PlainLabel(wraps=True)
        self.keys.told.connect(self.told.setText)
        tabs = self.tabs = QTabWidget()
        tabs.addTab(
            self._form(
                (tr("&Theme"), self.theme),
                (tr("&Size of texts"), self.texts),
                (tr("&Language, from the next page on"), self.language),
            ),
            tr("Looks"),
        )
        hand = self._form(
            (tr("Speed of the &mouse"), self.mouse),
            (tr("Speed of the &wheel"), self.wheel),
            (tr("Speed of &keys"), self.pace),
            ("", self.pitch),
            ("", self.turned_wheel),
            ("", self.swapped),
        )
        tabs.addTab(hand, tr("Mouse"))
        tabs.addTab(self._key_page(), tr("Keys"))
        kinds = QDialogButtonBox.StandardButton
        buttons = QDialogButtonBox(kinds.Ok | kinds.Cancel)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        for kind, words in ((kinds.Ok, tr("OK")), (kinds.Cancel, tr("Cancel"))):
            # neither the desktop's words, which may be in another language, nor its
            # icons, which fit no theme
            buttons.button(kind).setText(words)
            buttons.button(kind).setIcon(QIcon())
        self._rows = QVBoxLayout(self)
        self._rows.addWidget(tabs)
        self._rows.addWidget(buttons)

    def _form(self, *rows: tuple[str, QWidget]) -> QWidget:
        page = QWidget()
        form = lay(QFormLayout(page), 16, gap=(16, 10))
        form.setLabelAlignment(Qt.AlignmentFlag.AlignVCenter)
        for words, part in rows:
            if isinstance(part, QComboBox):
                label = PlainLabel(words)
                label.setBuddy(part)
                form.addRow(label, part)
                part.setAccessibleName(words.replace("&", ""))
                part.currentIndexChanged.connect(self._tell)
                hold(part, setMinimumWidth=180)
            else:
                form.addRow(part)
        return page

    def _key_page(self) -> QWidget:
        page = QWidget()
        rows = QVBoxLayout(page)
        hint = PlainLabel(
            tr("Choose a line and press Enter, or click twice; then its key.")
        )
        hint.setWordWrap(True)
        first, left = (
            QPushButton(tr("&First keys")),
            QPushButton(tr("For &left-handers")),
        )
        first.clicked.connect(lambda: self._take_hand(is_left=False))
        left.clicked.connect(lambda: self._take_hand(is_left=True))
        self.first_keys, self.left_handed = first, left
        line = QHBoxLayout()
        for button in (first, left):
            button.setAutoDefault(False)
            line.addWidget(button)
        line.addStretch(1)
        rows.addWidget(hint)
        rows.addWidget(self.keys, 1)
        rows.addWidget(self.told)
        rows.addLayout(line)
        return page

    def _take_hand(self, *, is_left: bool) -> None:
        """Take the keys and the mouse's buttons of one hand."""
        self.swapped.setChecked(is_left)
        self.keys.take(
            {a.value: key for a, key in LEFT_HANDED.items()} if is_left else {}
        )
        self.told.setText(
            tr("The right hand steers; the mouse's buttons are swapped.")
            if is_left
            else tr("All keys are as they were at first.")
        )

    @property
    def preferences(self) -> WindowPreferences:
        """Return what is chosen now."""
        return msgspec.structs.replace(
            self._before,
            theme=list(THEMES)[self.theme.currentIndex()],
            language=["", *LANGUAGES][self.language.currentIndex()],
            font_scale=FONT_STEPS[self.texts.currentIndex()],
            mouse_speed=SPEED_STEPS[self.mouse.currentIndex()],
            wheel_speed=SPEED_STEPS[self.wheel.currentIndex()],
            key_speed=SPEED_STEPS[self.pace.currentIndex()],
            inverts_pitch=self.pitch.isChecked(),
            inverts_wheel=self.turned_wheel.isChecked(),
            swaps_buttons=self.swapped.isChecked(),
            keys=self.keys.keys,
        )

    def _tell(self) -> None:
        self.chosen.emit(self.preferences)

    def reject(self) -> None:
        """Go back to what was before."""
        self.chosen.emit(self._before)
        super().reject()


def _steps(steps: tuple[float, ...] | list[float], chosen: float) -> QComboBox:
    """Return a choice of factors, with the nearest one chosen."""
    box = QComboBox()
    box.addItems([f"{step:.0%}" for step in steps])
    nearest = min(steps, key=lambda step: abs(step - chosen))
    box.setCurrentIndex(list(steps).index(nearest))
    return box
