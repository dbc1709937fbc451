"""The empty replay page offers the last flights."""

from pathlib import Path

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication

from app.window.replay.welcome_card import WelcomeCard, title_of


def test_a_flight_is_named_by_when_and_what_was_flown() -> None:
    recorded = Path("/x/2026-03-04_15-06-07_angled-look-30.paravol")
    assert title_of(recorded) == "2026-03-04  15:06   angled look 30"
    assert title_of(Path("/x/my own.paravol")) == "my own.paravol"


def test_choosing_a_line_opens_its_session(application: QApplication) -> None:
    card, chosen = WelcomeCard(), list[Path]()
    card.chosen.connect(chosen.append)
    card.recent.itemActivated.emit(card.recent.item(0))
    assert chosen == []  # that nothing is recorded yet is no session
    sessions = [Path("/x/b.paravol"), Path("/x/a.paravol")]
    card.show_recent(sessions)
    assert card.recent.currentRow() == 0
    for row in (0, 1):
        card.recent.itemActivated.emit(card.recent.item(row))
    assert chosen == sessions


def test_letters_are_left_to_the_page(application: QApplication) -> None:
    card = WelcomeCard()
    card.show_recent([Path("/x/q.paravol"), Path("/x/a.paravol")])
    none = Qt.KeyboardModifier.NoModifier
    for key, text, is_taken in (
        (Qt.Key.Key_Q, "q", False),
        (Qt.Key.Key_O, "o", False),
        (Qt.Key.Key_Down, "", True),
    ):
        event = QKeyEvent(QKeyEvent.Type.KeyPress, key, none, text)
        card.recent.keyPressEvent(event)
        assert event.isAccepted() is is_taken
    assert card.recent.currentRow() == 1
