"""Buttons for all that keys do in a flight: whoever has a mouse only finds everything.

A button presses the key that stands on it, so that both do the same and the keys are
learned by the way.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QCoreApplication, QEvent, QPoint, Qt, Slot
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QGridLayout, QMenu, QToolButton, QWidget

from app.window.style import BACKGROUND, EDGE, INK, PANEL, QUIET, READY

COLUMNS, BUTTON = 2, (62, 38)
"""Buttons beside one another; width and height of one at the designed size."""

REPEAT_MS = 120
"""Between two presses of a button that repeats, while it is held."""


@dataclass(frozen=True, slots=True)
class ActionButton:
    """Describe a button.

    label: what stands on it. key: it presses, and tells. does: what for, in words.
    is_held: it counts while it is held. repeats: the key is pressed again and again
    meanwhile. is_wide: it takes a row of its own.
    """

    label: str
    key: Qt.Key
    key_name: str
    does: str
    is_held: bool = False
    repeats: bool = False
    is_wide: bool = False


@dataclass(frozen=True, slots=True)
class Choice:
    """Describe a row of a menu: its name, what it does, what taking it means."""

    title: str
    does: str
    take: Callable[[], object]


class ActionBar(QWidget):
    """Show buttons in two columns; they never take the keyboard.

    There are no focus rings: everything here has a key of its own.
    """

    def __init__(self, window: QWidget, buttons: Sequence[ActionButton]) -> None:
        """Lay out the buttons; window: whose keys they press."""
        super().__init__()
        self.setObjectName("actions")
        self._window = window
        self._scale = 1.0
        self._buttons: dict[Qt.Key, QToolButton] = {}
        self._menus: dict[Qt.Key, QMenu] = {}
        self._grid = QGridLayout(self)
        self._wide = {button.key for button in buttons if button.is_wide}
        place = 0
        for said in buttons:
            if said.is_wide:
                place = -(-place // COLUMNS) * COLUMNS
            span = COLUMNS if said.is_wide else 1
            row, column = divmod(place, COLUMNS)
            self._grid.addWidget(self._made(said), row, column, 1, span)
            place += span
        self._grid.setRowStretch(len(buttons), 1)
        self.set_scale(1.0)

    def button(self, key: Qt.Key) -> QToolButton | None:
        """Return the button of a key; None where there is none."""
        return self._buttons.get(key)

    def menu(self, key: Qt.Key) -> QMenu | None:
        """Return what the button of a key opens; None where it presses the key."""
        return self._menus.get(key)

    def offer(self, key: Qt.Key, choices: Sequence[Choice]) -> None:
        """Let the button of a key open a menu instead of pressing it."""
        button = self._buttons[key]
        menu = self._menus[key] = QMenu(button)
        menu.setToolTipsVisible(True)
        for choice in choices:
            action = menu.addAction(f"{choice.title}: {choice.does}")
            action.setCheckable(True)
            action.setData(choice.title)
            # Qt adds whether it is checked now
            action.triggered.connect(lambda _=False, take=choice.take: take())
        button.clicked.connect(lambda: self._open(key))

    def mark(self, key: Qt.Key, is_on: bool) -> None:
        """Show whether what a button switches is on."""
        button = self._buttons.get(key)
        if button is not None and button.isChecked() != is_on:
            button.setChecked(is_on)

    def name(self, key: Qt.Key, label: str) -> None:
        """Put another label on the button of a key, such as what is chosen."""
        button = self._buttons.get(key)
        if button is not None:
            told = button.property("told")
            text = f"{label}\n{told}"
            if button.text() != text:
                button.setText(text)

    def set_scale(self, scale: float) -> None:
        """Scale the bar; 1 is the designed size."""
        self._scale = scale
        margin, gap = round(6 * scale), max(round(4 * scale), 1)
        self._grid.setContentsMargins(margin, 2 * margin, margin, 2 * margin)
        self._grid.setSpacing(gap)
        width, height = (round(length * scale) for length in BUTTON)
        self.setFixedWidth(COLUMNS * width + (COLUMNS - 1) * gap + 2 * margin)
        for key, button in self._buttons.items():
            columns = COLUMNS if key in self._wide else 1
            button.setFixedSize(columns * (width + gap) - gap, height)
        sheet = bar_sheet(scale)
        self.setStyleSheet(sheet)
        for menu in self._menus.values():
            menu.setStyleSheet(sheet)

    def _made(self, said: ActionButton) -> QToolButton:
        button = self._buttons[said.key] = QToolButton(self)
        button.setText(f"{said.label}\n{said.key_name}")
        button.setProperty("told", said.key_name)
        button.setToolTip(f"{said.does} (key {said.key_name})")
        button.setAccessibleName(said.label)
        button.setAccessibleDescription(said.does)
        button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        button.setCheckable(not (said.is_held or said.repeats))
        if said.is_held:
            button.pressed.connect(lambda: self._send(said.key, True))
            button.released.connect(lambda: self._send(said.key, False))
        else:
            button.setAutoRepeat(said.repeats)
            button.setAutoRepeatInterval(REPEAT_MS)
            button.clicked.connect(lambda: self._click(said.key))
        return button

    def _click(self, key: Qt.Key) -> None:
        if key in self._menus:
            return
        self._send(key, True)
        self._send(key, False)
        # what is on is told by `mark`, not by how often it was clicked
        self._buttons[key].setChecked(False)

    def _send(self, key: Qt.Key, is_down: bool) -> None:
        kind = QEvent.Type.KeyPress if is_down else QEvent.Type.KeyRelease
        event = QKeyEvent(kind, key, Qt.KeyboardModifier.NoModifier)
        QCoreApplication.sendEvent(self._window, event)

    @Slot()
    def _open(self, key: Qt.Key) -> None:
        button, menu = self._buttons[key], self._menus[key]
        chosen = button.text().partition("\n")[0].casefold()
        for action in menu.actions():
            action.setChecked(str(action.data()).casefold() == chosen)
        button.setChecked(False)
        menu.popup(button.mapToGlobal(QPoint(button.width(), 0)))


def bar_sheet(scale: float) -> str:
    """Return the rules of the bar and its menus; scale: on every length."""
    back, edge, ink = (c.name() for c in (BACKGROUND, EDGE, INK))
    panel, quiet, ready = (c.name() for c in (PANEL, QUIET, READY))
    width = max(round(scale), 1)
    return f"""
QWidget#actions {{ background: {back}; }}
QToolButton {{
    color: {ink}; background: {panel}; border: {width}px solid {edge};
    border-radius: {round(5 * scale)}px; font-size: {8.5 * scale:.1f}pt;
}}
QToolButton:hover {{ border-color: {quiet}; }}
QToolButton:pressed {{ background: {edge}; }}
QToolButton:checked {{ border: {2 * width}px solid {ready}; }}
QToolButton:disabled {{ color: {quiet}; }}
QMenu {{
    color: {ink}; background: {panel}; border: {width}px solid {quiet};
    font-size: {10 * scale:.1f}pt;
}}
QMenu::item {{ padding: {round(5 * scale)}px {round(18 * scale)}px; }}
QMenu::item:selected {{ background: {edge}; }}
"""
