"""Every action can be had on every keyboard, and no key asks for two."""

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent

from app.window.keyboard.actions import FIXED, LEFT_HANDED, STEERING, Act
from app.window.keyboard.key_map import KeyMap
from app.window.keyboard.places import SCAN_CODES
from devices.controls.keyboard import FINE, MOVES, PEDALS
from tests.app.window.keyboard.layouts import (
    FIVE,
    all_layouts,
    key_event,
    keys_of,
)

NONE = Qt.KeyboardModifier.NoModifier
MODIFIERS = (
    NONE,
    Qt.KeyboardModifier.ControlModifier,
    Qt.KeyboardModifier.AltModifier,
    Qt.KeyboardModifier.ShiftModifier,
)
NAMED = [
    *("Left", "Right", "Up", "Down", "PageUp", "PageDown", "Home", "End", "Space"),
    "Backspace",
    *("Shift", *(f"F{n}" for n in range(1, 8))),
]


def asked(
    keys: KeyMap, signs: dict[str, tuple[int, str]]
) -> dict[tuple[str, Qt.KeyboardModifier], Act | None]:
    """Return what all keys of a keyboard ask for."""
    found = {}
    for modifiers in MODIFIERS:
        for place in SCAN_CODES:
            event = key_event(place, signs, modifiers=modifiers)
            found[place, modifiers] = keys.action(event)
        for name in NAMED:
            event = QKeyEvent(QEvent.Type.KeyPress, Qt.Key[f"Key_{name}"], modifiers)
            found[name, modifiers] = keys.action(event)
    return found


def test_no_key_stands_twice_in_the_table_and_steering_has_its_names() -> None:
    assert {act.value for act in STEERING} == {*MOVES, *PEDALS, FINE}
    keys = [key for act in Act for key in act.keys]
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("layout", all_layouts())
def test_every_action_can_be_had_on_every_layout(layout: str) -> None:
    keys, signs = KeyMap(), keys_of(layout)
    found = asked(keys, signs)
    assert {act for act in Act if act not in found.values()} == set()
    # what is shown is what asks for it
    assert all(keys.label(act) for act in Act)


@pytest.mark.parametrize("layout", ["us", "de", *FIVE])
def test_left_handers_have_every_action_too(layout: str) -> None:
    keys = KeyMap()
    keys.take_keys({act.value: key for act, key in LEFT_HANDED.items()})
    found = asked(keys, keys_of(layout))
    assert {act for act in Act if act not in found.values()} == set()
    places = {"I": Act.MOVE_IN, "K": Act.MOVE_OUT, "J": Act.TURN_LEFT}
    assert {place: found[place, NONE] for place in places} == places


@given(
    st.sampled_from(["us", "de", *FIVE]),
    st.lists(
        st.tuples(
            st.sampled_from(sorted(set(Act) - FIXED)),
            st.sampled_from(sorted(SCAN_CODES)),
            st.sampled_from(MODIFIERS),
        ),
        max_size=12,
    ),
)
def test_whatever_is_changed_every_action_can_be_had(
    layout: str, changes: list[tuple[Act, str, Qt.KeyboardModifier]]
) -> None:
    keys, signs = KeyMap(), keys_of(layout)
    asked(keys, signs)
    chosen = dict[str, str]()
    for act, place, modifiers in changes:
        event = key_event(place, signs, modifiers=modifiers)
        made, _ = keys.given(act, event, chosen)
        if made != chosen:
            assert keys.action(event) is act
        chosen = made
    found = asked(keys, signs)
    assert {act for act in Act if act not in found.values()} == set()
    # kept and read again they are the same
    again = KeyMap()
    asked(again, signs)
    again.take_keys(chosen)
    assert asked(again, signs) == found


def test_an_action_that_loses_its_key_gets_the_others() -> None:
    keys, signs = KeyMap(), keys_of("us")
    chosen, told = keys.given(Act.WORK, key_event("M", signs), {})
    assert told is Act.IMAGING
    assert keys.label(Act.WORK, Act.IMAGING) == "M B"
    chosen, told = keys.given(Act.WORK, key_event("X", signs), chosen)
    assert told is None
    keys.take_keys({})
    assert keys.label(Act.WORK, Act.IMAGING) == "B M"
    keys.take_keys(chosen | {"nothing": "@W", "end": "", "undo": "@"})
    assert keys.label(Act.WORK, Act.IMAGING, Act.END, Act.UNDO) == "X B Q Z"


@pytest.mark.parametrize("variant", ["dvorak", "colemak", "workman"])
def test_every_action_can_be_had_where_letters_lie_elsewhere(variant: str) -> None:
    found = asked(KeyMap(), keys_of("us", variant))
    assert {act for act in Act if act not in found.values()} == set()


@pytest.mark.parametrize("layout", ["us", "de", *FIVE])
def test_what_steers_lies_at_the_same_place_on_all(layout: str) -> None:
    found = asked(KeyMap(), keys_of(layout))
    expected = {"W": Act.MOVE_IN, "S": Act.MOVE_OUT, "A": Act.TURN_LEFT}
    expected |= {"D": Act.TURN_RIGHT, "1": Act.RIGHT_PEDAL, "2": Act.LEFT_PEDAL}
    expected |= {"B": Act.WORK, "T": Act.NEXT_TOOL, "[": Act.HEAD_LEFT}
    assert {place: found[place, NONE] for place in expected} == expected


def test_keys_are_shown_as_the_keyboard_prints_them() -> None:
    keys = KeyMap()
    assert keys.label(Act.MOVE_IN, Act.MOVE_OUT) == "W S"
    assert keys.label(Act.NARROW, Act.WIDE) == "Ctrl ← →"
    assert keys.label(Act.NEXT_TOOL, Act.PREVIOUS_TOOL) == "T ⇧T"
    told = []
    keys.changed.connect(lambda: told.append(True))
    signs = keys_of("fr")
    asked(keys, signs)
    assert told
    assert keys.label(Act.MOVE_IN, Act.TURN_LEFT, Act.END) == "Z Q A"
    # the letter of undoing lies where the scope is moved in
    assert keys.label(Act.UNDO) == "W"
    assert keys.label(Act.HEAD_LEFT, Act.LEFT_PEDAL) == "^ É"
    keys = KeyMap()
    asked(keys, keys_of("ru"))
    assert keys.label(Act.MOVE_IN, Act.END, Act.IMAGING) == "Ц Й Ь"  # noqa: RUF001


@pytest.mark.parametrize("layout", ["us", *FIVE])
def test_the_standard_key_takes_a_cut_back(layout: str) -> None:
    signs = keys_of(layout)
    ctrl = Qt.KeyboardModifier.ControlModifier
    place = next((p for p, sign in signs.items() if sign == (ord("Z"), "z")), "Z")
    assert KeyMap().action(key_event(place, signs, modifiers=ctrl)) is Act.UNDO


def test_a_key_goes_up_for_what_it_went_down_for() -> None:
    keys, signs = KeyMap(), keys_of("us")
    ctrl, up = Qt.KeyboardModifier.ControlModifier, QEvent.Type.KeyRelease
    assert keys.action(key_event("W", signs)) is Act.MOVE_IN
    # Ctrl was pressed meanwhile
    assert keys.action(key_event("W", signs, up, ctrl)) is Act.MOVE_IN
    assert keys.action(key_event("W", signs, modifiers=ctrl)) is None
    assert keys.action(key_event("W", signs, up)) is None
