"""Buttons for all that keys do in a flight: whoever has a mouse only finds everything.

A button does what the key does that stands on it: the keys are learned by the way.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QPoint, Qt, Slot
from PySide6.QtWidgets import QGridLayout, QMenu, QToolButton, QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.keyboard.page_commands import Commands
from app.window.scaling import Scaled
from app.window.style import BACKGROUND, EDGE, INK, PANEL, QUIET, READY
from app.window.texts import tr

COLUMNS, BUTTON = 2, (62, 38)
"""Buttons beside one another; width and height of one at the designed size."""

REPEAT_MS = 120
"""Between two presses of a button that repeats, while it is held."""


WIDE = {Act.NEXT_TOOL}
"""They take a row of their own."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Describe a row of a menu: its name, what it does, what taking it means."""

    title: str
    does: str
    take: Callable[[], object]


class ActionBar(QWidget, Scaled):
    """Show buttons in two columns; they never take the keyboard.

    There are no focus rings: everything here has a key of its own.
    """

    def __init__(self, labels: Mapping[Act, str], commands: Commands) -> None:
        """Lay out a button for each action that has a label, in their order."""
        super().__init__()
        self.setObjectName("actions")
        self._commands = commands
        self._buttons: dict[Act, QToolButton] = {}
        self._menus: dict[Act, QMenu] = {}
        self._grid = QGridLayout(self)
        place = 0
        for act, label in labels.items():
            span = 1
            if act in WIDE:
                place = -(-place // COLUMNS) * COLUMNS
                span = COLUMNS
            row, column = divmod(place, COLUMNS)
            self._grid.addWidget(self._made(act, label), row, column, 1, span)
            place += span
        self._grid.setRowStretch(len(labels), 1)
        KEYS.changed.connect(self._tell_keys)
        self.take_scale()

    def button(self, act: Act) -> QToolButton | None:
        """Return the button of an action; None where there is none."""
        return self._buttons.get(act)

    def menu(self, act: Act) -> QMenu | None:
        """Return what the button of an action opens; None where it does that."""
        return self._menus.get(act)

    def offer(self, act: Act, choices: Sequence[Choice]) -> None:
        """Let the button of an action open a menu instead of doing that."""
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
            button.setToolTip(tr("{does} (key {key})", does=tr(act.does), key=key))

    @Slot()
    def _tell_keys(self) -> None:
        for act in self._buttons:
            self._tell(act)

    def take_scale(self) -> None:
        """Scale buttons and menus."""
        scale = self.scale
        margin, gap = round(6 * scale), max(round(4 * scale), 1)
        self._grid.setContentsMargins(margin, 2 * margin, margin, 2 * margin)
        self._grid.setSpacing(gap)
        width, height = (round(length * scale) for length in BUTTON)
        self.setFixedWidth(COLUMNS * width + (COLUMNS - 1) * gap + 2 * margin)
        for act, button in self._buttons.items():
            columns = COLUMNS if act in WIDE else 1
            button.setFixedSize(columns * (width + gap) - gap, height)
        sheet = bar_sheet(scale)
        self.setStyleSheet(sheet)
        for menu in self._menus.values():
            menu.setStyleSheet(sheet)

    def _made(self, act: Act, label: str) -> QToolButton:
        button = self._buttons[act] = QToolButton(self)
        command = self._commands[act]
        self.name(act, tr(label))
        button.setAccessibleName(tr(label))
        button.setAccessibleDescription(tr(act.does))
        button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        button.setCheckable(not (command.release or command.repeats))
        if command.release is not None:
            button.pressed.connect(command.press)
            button.released.connect(command.release)
        else:
            button.setAutoRepeat(command.repeats)
            button.setAutoRepeatInterval(REPEAT_MS)
            button.clicked.connect(lambda: self._click(act))
        return button

    def _click(self, act: Act) -> None:
        if act not in self._menus:
            self._commands[act].press()
            # what is on is told by `mark`, not by how often it was clicked
            self._buttons[act].setChecked(False)

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
