"""Which action a key asks for, by the table and by what the user changed in it."""

import re
from collections.abc import Mapping

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QKeyEvent

from app.window.keyboard.actions import FIXED, NAMED, STEERING, Act
from app.window.keyboard.places import SCAN_CODES, name_of, place_of
from app.window.keyboard.printed_keys import PrintedKeys
from app.window.texts import later, tr
from devices.controls.keyboard import Feel
from paravol.trainee.window_preferences import WindowPreferences

_MODIFIERS = {
    "Ctrl": Qt.KeyboardModifier.ControlModifier,
    "Alt": Qt.KeyboardModifier.AltModifier,
    "Shift": Qt.KeyboardModifier.ShiftModifier,
}
_SIGNS = {
    **{"Left": "←", "Right": "→", "Up": "↑", "Down": "↓"},
    **{"PageUp": later("Pg↑"), "PageDown": later("Pg↓"), "Home": later("Home")},
    **{"End": later("End"), "Space": later("Space"), "Backspace": later("Backspace")},
}


class KeyMap(QObject):
    """Tell the action of a key event, and the keys of an action."""

    changed = Signal()
    """Keys have other actions, or print something else than was believed."""

    def __init__(self) -> None:
        super().__init__()
        self.printed = PrintedKeys()
        self._down: dict[str, Act | None] = {}
        self._keys: dict[Act, tuple[str, ...]] = {}
        self._acts: dict[str, Act] = {}
        self._moved: dict[str, str] | None = None
        self.follow(WindowPreferences())

    def follow(self, chosen: WindowPreferences) -> None:
        """Take what the user chose of mouse and keys."""
        self.feel = Feel(
            chosen.mouse_speed,
            -1.0 if chosen.inverts_pitch else 1.0,
            -chosen.wheel_speed if chosen.inverts_wheel else chosen.wheel_speed,
            chosen.key_speed,
        )
        buttons = Qt.MouseButton
        self.turning_button = (
            buttons.LeftButton if chosen.swaps_buttons else buttons.RightButton
        )
        self.take_keys(chosen.keys)

    def take_keys(self, chosen: Mapping[str, str]) -> None:
        """Take the user's keys, by the names of actions; the rest is as in the table.

        What is not known is passed over. A key that was chosen for one action is no
        other's; an action never loses its first key to another's second one.
        """
        self._keys = {act: act.keys for act in Act}
        taken = {
            key: NAMED[name]
            for name, key in chosen.items()
            if name in set(Act) - FIXED and _is_key(key)
        }
        for key, act in taken.items():
            self._keys[act] = (key, *self._keys[act][1:])
        self._acts = {k: act for act, keys in self._keys.items() for k in keys}
        self._acts |= {keys[0]: act for act, keys in self._keys.items()} | taken
        self._down.clear()
        self._moved = None
        self.changed.emit()

    def action(self, event: QKeyEvent) -> Act | None:
        """Return what a key asks for when it goes down; the same when it goes up."""
        place, name = place_of(event), name_of(event)
        key = place or name
        match event.type():
            case QEvent.Type.KeyPress:
                if self.printed.learn(event):
                    self._moved = None
                    self.changed.emit()
                self._down[key] = self._asked(place, name, event.modifiers())
                return self._down[key]
            case QEvent.Type.KeyRelease:
                return self._down.get(key)
        return self._asked(place, name, event.modifiers())

    def _asked(
        self, place: str | None, name: str, modifiers: Qt.KeyboardModifier
    ) -> Act | None:
        held = [word for word, bit in _MODIFIERS.items() if modifiers & bit]
        if name in _NO_PREFIX:
            held = []
        ways = [held]
        if "Shift" in held:
            # Shift alone makes no other key: it slows, and types signs
            ways.append(held[:-1])
        for words in ways:
            before = "".join(f"{word}+" for word in words)
            for key in (f"@{place}", self._letter_moved_to(place), name, place):
                if (act := self._acts.get(f"{before}{key}")) is not None:
                    return act
        return None

    def _letter_moved_to(self, place: str | None) -> str | None:
        """Return the letter that is had at a place as its own is needed as a place.

        On a French keyboard A lies where steering needs it; it has Q's place, where
        it prints A. So it goes on where that one is needed, too.
        """
        if self._moved is None:
            self._moved = {}
            for letter in SCAN_CODES:
                at, seen = self.printed.place(letter), set[str]()
                while at is not None and f"@{at}" in self._acts and at not in seen:
                    seen.add(at)
                    at = self.printed.place(at)
                if letter in self._acts and at is not None and seen:
                    self._moved[at] = letter
        return None if place is None else self._moved.get(place)

    def key(self, act: Act) -> str:
        """Return the first key of an action, as the table writes it."""
        return self._keys[act][0]

    def given(
        self, act: Act, event: QKeyEvent, chosen: Mapping[str, str]
    ) -> tuple[dict[str, str], Act | None]:
        """Return what is chosen when an action gets the key of an event.

        chosen: before. The action that had the key gets the other's, and is told.
        Nothing changes by a key that is fixed, or by one without which some action
        could not be had on this keyboard.
        """
        place, name = place_of(event), name_of(event)
        words = [word for word, bit in _MODIFIERS.items() if event.modifiers() & bit]
        key = "".join(f"{word}+" for word in words) + (f"@{place}" if place else name)
        before = self._asked(place, name, event.modifiers())
        if name in _FIXED_KEYS or not _is_key(key) or before is act:
            return dict(chosen), None
        made = {**chosen, act.value: key}
        is_its_own = key in self._acts or "Shift" not in words
        if before is not None and (is_its_own or before in STEERING):
            made[before.value] = self._keys[act][0]
        self.take_keys(made)
        if any(not self._shown(other) for other in Act):
            self.take_keys(chosen)
            return dict(chosen), before
        return made, before if before is not None and before.value in made else None

    def label(self, *acts: Act) -> str:
        """Return the keys of actions as the user's keyboard prints them."""
        words = [self._shown(act) for act in acts]
        common = words[0].rpartition("+")[0] if len(words[0]) > 2 else ""
        if common and all(word.startswith(f"{common}+") for word in words):
            rest = " ".join(word.removeprefix(f"{common}+") for word in words)
            return f"{common} {rest}"
        return " ".join(words)

    def _shown(self, act: Act) -> str:
        for key in self._keys[act]:
            before, sign = _parted(key)
            if sign[0] == "@" and len(sign) > 1:
                place: str | None = sign[1:]
            elif len(sign) > 1:
                return _said(before) + tr(_SIGNS.get(sign, sign))
            else:
                place = self.printed.place(sign)
            for at in (place, sign):
                if at in SCAN_CODES and self._is_at(at, before, act):
                    return _said(before) + self.printed[at]
        return ""

    def _is_at(self, place: str, before: str, act: Act) -> bool:
        """Return whether a place asks for an action, on the user's keyboard."""
        mask = Qt.KeyboardModifier.NoModifier
        for word in before.split("+")[:-1]:
            mask |= _MODIFIERS[word]
        return self._asked(place, self.printed[place], mask) is act


_NO_PREFIX = {"Shift", "Control", "Alt", "Meta", "AltGr"}
"""Keys that are modifiers themselves, which say so when they go up."""


_FIXED_KEYS = {*_NO_PREFIX, "Escape", "Return", "Enter", "Tab", "Backtab"}
"""Keys that mean the same everywhere."""

_KEY = re.compile(r"(Ctrl\+)?(Alt\+)?(Shift\+)?(@?.|[A-Z]\w+)")


def _is_key(text: str) -> bool:
    """Return whether a text names a key."""
    if _KEY.fullmatch(text) is None:
        return False
    sign = _parted(text)[1].removeprefix("@") or "@"
    return sign.upper() in SCAN_CODES or hasattr(Qt.Key, f"Key_{sign}")


def _said(modifiers: str) -> str:
    """Return modifiers as they stand on keys."""
    return modifiers.replace("Shift+", "⇧").replace("Ctrl", tr("Ctrl"))


def _parted(key: str) -> tuple[str, str]:
    """Return a key's modifiers, with their plus signs, and the key itself."""
    cut = key.rfind("+", 0, -1) + 1
    return key[:cut], key[cut:]


KEYS = KeyMap()
"""Of the window; it follows the user's preferences."""
