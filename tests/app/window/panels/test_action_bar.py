"""Buttons that press the keys which stand on them."""

from functools import partial

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QToolButton, QWidget

from app.window.keyboard.actions import Act
from app.window.panels.action_bar import ActionBar, ActionButton, Choice

Key = Qt.Key
BUTTONS = (
    ActionButton(Act.SUCTION, "Suction"),
    ActionButton(Act.WORK, "Work", is_held=True),
    ActionButton(Act.NEXT_TOOL, "Tool"),
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


def button(bar: ActionBar, act: Act) -> QToolButton:
    found = bar.button(act)
    assert found is not None
    return found


def test_a_button_presses_its_key_and_tells_it(window: Window) -> None:
    bar = ActionBar(window, BUTTONS)
    suction = button(bar, Act.SUCTION)
    assert suction.toolTip() == "Turns the tool's suction on or off (key N)"
    assert suction.focusPolicy() is Qt.FocusPolicy.NoFocus
    QTest.mouseClick(suction, Qt.MouseButton.LeftButton)
    assert window.came == [(Key.Key_N, True), (Key.Key_N, False)]
    # what is on is what the flight says, not how often it was clicked
    assert not suction.isChecked()
    bar.mark(Act.SUCTION, True)
    assert suction.isChecked()


def test_a_held_button_holds_its_key(window: Window) -> None:
    work = button(ActionBar(window, BUTTONS), Act.WORK)
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
    bar.offer(Act.NEXT_TOOL, choices)
    bar.name(Act.NEXT_TOOL, "Ball probe")
    tool = button(bar, Act.NEXT_TOOL)
    QTest.mouseClick(tool, Qt.MouseButton.LeftButton)
    menu = bar.menu(Act.NEXT_TOOL)
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
