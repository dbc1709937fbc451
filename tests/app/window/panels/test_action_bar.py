"""Buttons that do what the keys do which stand on them."""

from collections.abc import Callable
from functools import partial

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QToolButton

from app.window.keyboard.actions import Act
from app.window.keyboard.page_commands import Command
from app.window.panels.action_bar import ActionBar, Choice

LABELS = {Act.SUCTION: "Suction", Act.WORK: "Work", Act.NEXT_TOOL: "Tool"}


@pytest.fixture
def done() -> list[str]:
    return []


@pytest.fixture
def bar(application: QApplication, done: list[str]) -> ActionBar:
    def note(words: str) -> Callable[[], None]:
        return lambda: done.append(words)

    commands = {
        Act.SUCTION: Command(note("suction")),
        Act.WORK: Command(note("work"), note("rest")),
        Act.NEXT_TOOL: Command(note("next tool")),
    }
    return ActionBar(LABELS, commands)


def button(bar: ActionBar, act: Act) -> QToolButton:
    found = bar.button(act)
    assert found is not None
    return found


def test_a_button_does_what_its_key_does_and_tells_it(
    bar: ActionBar, done: list[str]
) -> None:
    suction = button(bar, Act.SUCTION)
    assert suction.toolTip() == "Turns the tool's suction on or off (key N)"
    assert suction.focusPolicy() is Qt.FocusPolicy.NoFocus
    QTest.mouseClick(suction, Qt.MouseButton.LeftButton)
    assert done == ["suction"]
    # what is on is what the flight says, not how often it was clicked
    assert not suction.isChecked()
    bar.mark(Act.SUCTION, True)
    assert suction.isChecked()


def test_a_held_button_counts_until_it_is_let_go(
    bar: ActionBar, done: list[str]
) -> None:
    work = button(bar, Act.WORK)
    QTest.mousePress(work, Qt.MouseButton.LeftButton)
    assert done == ["work"]
    QTest.mouseRelease(work, Qt.MouseButton.LeftButton)
    assert done == ["work", "rest"]


def test_a_menu_offers_what_its_button_steps_through(
    bar: ActionBar, done: list[str]
) -> None:
    taken = list[str]()
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
    assert not done
    told = [(a.text(), a.isChecked()) for a in menu.actions()]
    assert told == [
        ("Curette: does Curette", False),
        ("Ball probe: does Ball probe", True),
    ]
    menu.actions()[0].trigger()
    assert taken == ["Curette"]
    menu.close()
