"""Buttons for all that keys do in a flight: whoever has a mouse only finds everything.

A button presses the key that stands on it, so that both do the same and the keys are
learned by the way.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QCoreApplication, QPoint, Qt, Slot
from PySide6.QtWidgets import QGridLayout, QMenu, QToolButton, QWidget

from app.window.keyboard.actions import OF, Act
from app.window.keyboard.key_map import KEYS
from app.window.style import BACKGROUND, EDGE, INK, PANEL, QUIET, READY
from app.window.texts import tr

COLUMNS, BUTTON = 2, (62, 38)
"""Buttons beside one another; width and height of one at the designed size."""

REPEAT_MS = 120
"""Between two presses of a button that repeats, while it is held."""


@dataclass(frozen=True, slots=True)
class ActionButton:
    """Describe a button.

    act: whose key it presses, and tells. label: what stands on it. is_held: it counts
    while it is held. repeats: the key is pressed again and again meanwhile. is_wide: it
    takes a row of its own.
    """

    act: Act
    label: str
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
        self._buttons: dict[Act, QToolButton] = {}
        self._menus: dict[Act, QMenu] = {}
        self._grid = QGridLayout(self)
        self._wide = {button.act for button in buttons if button.is_wide}
        place = 0
        for said in buttons:
            if said.is_wide:
                place = -(-place // COLUMNS) * COLUMNS
            span = COLUMNS if said.is_wide else 1
            row, column = divmod(place, COLUMNS)
            self._grid.addWidget(self._made(said), row, column, 1, span)
            place += span
        self._grid.setRowStretch(len(buttons), 1)
        KEYS.changed.connect(self._tell_keys)
        self.set_scale(1.0)

    def button(self, act: Act) -> QToolButton | None:
        """Return the button of an action; None where there is none."""
        return self._buttons.get(act)

    def menu(self, act: Act) -> QMenu | None:
        """Return what the button of an action opens; None where it presses the key."""
        return self._menus.get(act)

    def offer(self, act: Act, choices: Sequence[Choice]) -> None:
        """Let the button of an action open a menu instead of pressing it."""
        button = self._buttons[act]
        menu = self._menus[act] = QMenu(button)
        menu.setToolTipsVisible(True)
        for choice in choices:
            action = menu.addAction(f"{choice.title}: {choice.does}")
            action.setCheckable(True)
            action.setData(choice.title)
            # Qt adds whether it is checked now
            action.triggered.connect(lambda _=False, take=choice.take: take())
        button.clicked.connect(lambda: self._open(act))

    def mark(self, act: Act, is_on: bool) -> None:
        """Show whether what a button switches is on."""
        button = self._buttons.get(act)
        if button is not None and button.isChecked() != is_on:
            button.setChecked(is_on)

    def name(self, act: Act, label: str) -> None:
        """Put another label on the button of an action, such as what is chosen."""
        button = self._buttons.get(act)
        if button is not None:
            button.setProperty("label", label)
            self._tell(act)

    def _tell(self, act: Act) -> None:
        """Say a button's key, as it is now."""
        button, key = self._buttons[act], KEYS.label(act)
        text = f"{button.property('label')}\n{key}"
        if button.text() != text:
            button.setText(text)
            button.setToolTip(tr("{does} (key {key})", does=tr(OF[act].does), key=key))

    @Slot()
    def _tell_keys(self) -> None:
        for act in self._buttons:
            self._tell(act)

    def set_scale(self, scale: float) -> None:
        """Scale the bar; 1 is the designed size."""
        self._scale = scale
        margin, gap = round(6 * scale), max(round(4 * scale), 1)
        self._grid.setContentsMargins(margin, 2 * margin, margin, 2 * margin)
        self._grid.setSpacing(gap)
        width, height = (round(length * scale) for length in BUTTON)
        self.setFixedWidth(COLUMNS * width + (COLUMNS - 1) * gap + 2 * margin)
        for act, button in self._buttons.items():
            columns = COLUMNS if act in self._wide else 1
            button.setFixedSize(columns * (width + gap) - gap, height)
        sheet = bar_sheet(scale)
        self.setStyleSheet(sheet)
        for menu in self._menus.values():
            menu.setStyleSheet(sheet)

    def _made(self, said: ActionButton) -> QToolButton:
        button = self._buttons[said.act] = QToolButton(self)
        self.name(said.act, tr(said.label))
        button.setAccessibleName(tr(said.label))
        button.setAccessibleDescription(tr(OF[said.act].does))
        button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        button.setCheckable(not (said.is_held or said.repeats))
        if said.is_held:
            button.pressed.connect(lambda: self._send(said.act, True))
            button.released.connect(lambda: self._send(said.act, False))
        else:
            button.setAutoRepeat(said.repeats)
            button.setAutoRepeatInterval(REPEAT_MS)
            button.clicked.connect(lambda: self._click(said.act))
        return button

    def _click(self, act: Act) -> None:
        if act in self._menus:
            return
        self._send(act, True)
        self._send(act, False)
        # what is on is told by `mark`, not by how often it was clicked
        self._buttons[act].setChecked(False)

    def _send(self, act: Act, is_down: bool) -> None:
        QCoreApplication.sendEvent(self._window, KEYS.press(act)[not is_down])

    @Slot()
    def _open(self, act: Act) -> None:
        button, menu = self._buttons[act], self._menus[act]
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
