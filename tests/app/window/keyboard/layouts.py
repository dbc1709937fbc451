"""Keyboards of the world: what the library of X11 and Wayland says that keys print."""

import ctypes
from functools import cache
from pathlib import Path

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent

from app.window.keyboard.places import SCAN_CODES

XKB_OFFSET, FIRST_DEAD_SYMBOL, UNKNOWN = 8, 0xFE50, 0x01FFFFFF
LIST = Path("/usr/share/X11/xkb/rules/evdev.lst")
FIVE = "fr", "ru", "gr", "il", "ara"


class _Names(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_char_p)
        for name in ("rules", "model", "layout", "variant", "options")
    ]


def all_layouts() -> list[str]:
    """Return the names of all layouts that are installed; the five at least."""
    if not LIST.is_file():
        return list(FIVE)
    part = LIST.read_text().partition("! layout\n")[2].partition("\n\n")[0]
    return [line.split()[0] for line in part.splitlines()]


@cache
def keys_of(layout: str, variant: str = "") -> dict[str, tuple[int, str]]:
    """Return Qt's key and the text of each place, as it is typed without Shift."""
    keys = {}
    for place, (symbol, sign) in _symbols(layout, variant).items():
        key = ord(sign.upper()) if len(sign.upper()) == 1 and sign > " " else UNKNOWN
        if FIRST_DEAD_SYMBOL <= symbol < FIRST_DEAD_SYMBOL + 13:
            key = Qt.Key.Key_Dead_Grave + symbol - FIRST_DEAD_SYMBOL
        keys[place] = key, "" if sign == "\0" else sign
    return keys


def _symbols(layout: str, variant: str = "") -> dict[str, tuple[int, str]]:
    try:
        xkb = ctypes.CDLL("libxkbcommon.so.0")
    except OSError:
        pytest.skip("libxkbcommon0 is not installed")
    for name in ("xkb_context_new", "xkb_keymap_new_from_names", "xkb_state_new"):
        getattr(xkb, name).restype = ctypes.c_void_p
    context = ctypes.c_void_p(xkb.xkb_context_new(0))
    names = _Names(b"evdev", b"pc105", layout.encode(), variant.encode(), b"")
    keymap = ctypes.c_void_p(
        xkb.xkb_keymap_new_from_names(context, ctypes.byref(names), 0)
    )
    if not keymap:
        pytest.skip(f"the layout {layout} is not installed")
    state = ctypes.c_void_p(xkb.xkb_state_new(keymap))
    signs = {
        place: (
            xkb.xkb_state_key_get_one_sym(state, code + XKB_OFFSET),
            chr(xkb.xkb_state_key_get_utf32(state, code + XKB_OFFSET)),
        )
        for place, code in SCAN_CODES.items()
    }
    xkb.xkb_state_unref(state)
    xkb.xkb_keymap_unref(keymap)
    xkb.xkb_context_unref(context)
    return signs


def key_event(
    place: str,
    keys: dict[str, tuple[int, str]],
    kind: QEvent.Type = QEvent.Type.KeyPress,
    modifiers: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier,
) -> QKeyEvent:
    """Return what Qt makes of a key at a place, on some keyboard."""
    key, text = keys[place]
    code = SCAN_CODES[place] + XKB_OFFSET
    return QKeyEvent(kind, key, modifiers, code, 0, 0, text, False, 1)
