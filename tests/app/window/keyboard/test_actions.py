"""The manual's table of keys is the program's."""

from pathlib import Path

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from app.window.keyboard.actions import GESTURES, Act, Group, rows
from app.window.keyboard.key_map import KeyMap

MANUAL = Path(__file__).parents[4] / "docs" / "trainee.md"
BEGIN, END = "<!-- keys -->\n", "<!-- end of keys -->\n"


def table() -> str:
    """Return all keys of a flight as the manual has them."""
    keys = KeyMap()
    found = "| keys | do |\n|---|---|\n"
    for group in Group:
        told = [*rows(group, keys.label, set[Act]()), *GESTURES.get(group, [])]
        found += "".join(f"| {key} | {does} |\n" for key, does in told)
    return found


def test_the_manual_lists_the_keys_as_they_are() -> None:
    shown = MANUAL.read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0]
    assert shown == table()
