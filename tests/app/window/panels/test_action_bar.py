"""Buttons that press the keys which stand on them."""

from functools import partial

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QToolButton, QWidget

from app.window.panels.action_bar import ActionBar, ActionButton, Choice

Key = Qt.Key
BUTTONS = (
    ActionButton("Suction", Key.Key_N, "N", "Turns the suction on or off"),
    ActionButton("Work", Key.Key_B, "B", "Cuts while held", is_held=True),
    ActionButton("Tool", Key.Key_T, "T", "Puts in another tool"),
)


class Window(QWidget):
    """Notes the keys that come."""

    def __init__(self) -> None:
        super().__init__()
        self.came: list[tuple[int, bool]] = []

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        self.came.append((event.key(), True))

    def keyReleaseEvent(self, event: QKeyEvent) -> None:  # noqa: N802
        self.came.append((event.key(), False))


@pytest.fixture
def window(application: QApplication) -> Window:
    return Window()


def button(bar: ActionBar, key: Qt.Key) -> QToolButton:
    found = bar.button(key)
    assert found is not None
    return found


def test_a_button_presses_its_key_and_tells_it(window: Window) -> None:
    bar = ActionBar(window, BUTTONS)
    suction = button(bar, Key.Key_N)
    assert suction.toolTip() == "Turns the suction on or off (key N)"
    assert suction.focusPolicy() is Qt.FocusPolicy.NoFocus
    QTest.mouseClick(suction, Qt.MouseButton.LeftButton)
    assert window.came == [(Key.Key_N, True), (Key.Key_N, False)]
    # what is on is what the flight says, not how often it was clicked
    assert not suction.isChecked()
    bar.mark(Key.Key_N, True)
    assert suction.isChecked()


def test_a_held_button_holds_its_key(window: Window) -> None:
    work = button(ActionBar(window, BUTTONS), Key.Key_B)
    QTest.mousePress(work, Qt.MouseButton.LeftButton)
    assert window.came == [(Key.Key_B, True)]
    QTest.mouseRelease(work, Qt.MouseButton.LeftButton)
    assert window.came == [(Key.Key_B, True), (Key.Key_B, False)]


def test_a_menu_offers_what_its_button_steps_through(window: Window) -> None:
    bar, taken = ActionBar(window, BUTTONS), list[str]()
    choices = [
        Choice(name, f"does {name}", partial(taken.append, name))
        for name in ("Curette", "Ball probe")
    ]
    bar.offer(Key.Key_T, choices)
    bar.name(Key.Key_T, "Ball probe")
    tool = button(bar, Key.Key_T)
    QTest.mouseClick(tool, Qt.MouseButton.LeftButton)
    menu = bar.menu(Key.Key_T)
    assert menu is not None
    assert menu.isVisible()
    assert not window.came
    told = [(a.text(), a.isChecked()) for a in menu.actions()]
    assert told == [
        ("Curette: does Curette", False),
        ("Ball probe: does Ball probe", True),
    ]
    menu.actions()[0].trigger()
    assert taken == ["Curette"]
    menu.close()
