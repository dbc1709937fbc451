"""Where a key lies, and which letter it is: two answers that layouts tell apart.

Only keys that print something have a place. All others, such as arrows, have the same
name on every layout, and whoever gives Escape another place wants it there.
"""

import sys

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent

_ROWS = {2: "1234567890-=", 16: "QWERTYUIOP[]", 30: "ASDFGHJKL;'`", 43: "\\ZXCVBNM,./"}
SCAN_CODES = {
    place: first + step
    for first, row in _ROWS.items()
    for step, place in enumerate(row)
} | {"<": 86}
"""Of places, named by what an American keyboard prints there; ``<`` is the key beside
the left Shift that it does not have. Linux and Windows count alike among these."""

_XKB_OFFSET = 8
"""What X11 and Wayland add to Linux's own code."""

_MAC_CODES = {
    **dict(zip("ASDFHGZXCV<BQWERYT123465=97-80]OU[IP", range(36), strict=True)),
    **dict(zip("LJ'K;\\,/NM.", (*range(37, 48),), strict=True)),
    "`": 50,
}
"""macOS tells no scan codes; its virtual key codes are places."""

_IS_MAC, _IS_WINDOWS = sys.platform == "darwin", sys.platform == "win32"
_BY_CODE = {
    code + (0 if _IS_MAC or _IS_WINDOWS else _XKB_OFFSET): place
    for place, code in (_MAC_CODES if _IS_MAC else SCAN_CODES).items()
}


def place_of(event: QKeyEvent) -> str | None:
    """Return where a key lies; None where it prints nothing.

    An event that no keyboard made has no scan code: there its letter says where an
    American keyboard has it.
    """
    code = event.nativeVirtualKey() if _IS_MAC else event.nativeScanCode()
    # A's code on a Mac is 0, but some bit is set in all that a keyboard makes there
    if code or (_IS_MAC and event.nativeModifiers()):
        place = _BY_CODE.get(code)
        if place is not None:
            return place
    name = name_of(event)
    return name if name in SCAN_CODES and name != "<" else None


def name_of(event: QKeyEvent) -> str:
    """Return a key's sign on the user's layout, or its name where it prints none."""
    key = event.key()
    if Qt.Key.Key_Space < key < Qt.Key.Key_Escape:
        return chr(key)
    return Qt.Key(key).name.removeprefix("Key_")


def american(event: QKeyEvent) -> Qt.Key:
    """Return the key for who asks for letters.

    Where a layout has no Latin ones it is the one of an American keyboard.
    """
    place, key = place_of(event), event.key()
    is_foreign = Qt.Key.Key_AsciiTilde < key < Qt.Key.Key_Escape
    return Qt.Key(ord(place)) if is_foreign and place is not None else Qt.Key(key)
