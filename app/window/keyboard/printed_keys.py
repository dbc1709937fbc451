"""What the user's keyboard prints at a place.

X11 and Windows tell it; elsewhere it is learned from the keys as they are pressed.
"""

import ctypes
import sys

from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication, QKeyEvent

from app.window.keyboard.places import SCAN_CODES, place_of

_CORE_KEYBOARD, _STATE_BYTES = 0x100, 64
_CODE_TO_KEY, _KEY_TO_CHARACTER = 1, 2
_XKB_OFFSET = 8
_DEAD = "`´^~¯˘˙¨˚˝ˇ¸˛"  # noqa: RUF001
"""Accents that wait for a letter, from the first on as both X11 and Qt count them."""

_FIRST_DEAD_SYMBOL, _FIRST_DEAD_KEY = 0xFE50, Qt.Key.Key_Dead_Grave


class PrintedKeys:
    """Know what stands on keys; an American keyboard until another is seen."""

    def __init__(self) -> None:
        self._signs: dict[str, str] = {}
        self._was_asked = False

    def __getitem__(self, place: str) -> str:
        """Return the sign at a place, a capital letter where it is one."""
        if not self._was_asked and QGuiApplication.instance() is not None:
            self._was_asked = True
            self._signs = _told_by_system() | self._signs
        return self._signs.get(place, place)

    def place(self, sign: str) -> str | None:
        """Return where a sign is printed; None where it is not."""
        return next((place for place in SCAN_CODES if self[place] == sign), None)

    def learn(self, event: QKeyEvent) -> bool:
        """Note what a pressed key prints; return whether that was news."""
        place, sign = place_of(event), capital(event.text())
        sign = sign or _dead(event.key() - _FIRST_DEAD_KEY)
        is_plain = event.modifiers() == Qt.KeyboardModifier.NoModifier
        if not is_plain or place is None or not sign or self[place] == sign:
            return False
        self._signs[place] = sign
        return True

    def forget(self) -> None:
        """Ask anew."""
        self._signs, self._was_asked = {}, False


def capital(text: str) -> str:
    """Return one sign that can be seen, large; "" for all else.

    A second small form of a letter, such as the sigma that ends a Greek word, stays.
    """
    large = text.upper()
    sign = large if len(large) == 1 and large.lower() == text.lower() else text
    return sign if len(sign) == 1 and sign.isprintable() and sign != " " else ""


def _dead(number: int) -> str:
    return _DEAD[number] if 0 <= number < len(_DEAD) else ""


def _told_by_system() -> dict[str, str]:
    platform = QGuiApplication.platformName()
    if platform == "xcb":
        return _told_by_x11()
    return _told_by_windows() if platform == "windows" else {}


def _told_by_x11() -> dict[str, str]:
    """Ask the server by its own library, which Qt's plugin for it has loaded."""
    try:
        x11 = ctypes.CDLL("libX11.so.6")
        xkb = ctypes.CDLL("libxkbcommon.so.0")
    except OSError:
        return {}
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XkbKeycodeToKeysym.restype = ctypes.c_ulong
    display = ctypes.c_void_p(x11.XOpenDisplay(None))
    if not display:
        return {}
    state = ctypes.create_string_buffer(_STATE_BYTES)
    x11.XkbGetState(display, _CORE_KEYBOARD, state)
    group = state.raw[0]
    signs = {}
    for place, code in SCAN_CODES.items():
        symbol = x11.XkbKeycodeToKeysym(display, code + _XKB_OFFSET, group, 0)
        sign = capital(chr(xkb.xkb_keysym_to_utf32(ctypes.c_uint32(symbol))))
        signs[place] = sign or _dead(symbol - _FIRST_DEAD_SYMBOL)
    x11.XCloseDisplay(display)
    return {place: sign for place, sign in signs.items() if sign}


def _told_by_windows() -> dict[str, str]:
    signs = dict[str, str]()
    if sys.platform == "win32":
        translate = ctypes.windll.user32.MapVirtualKeyW
        for place, code in SCAN_CODES.items():
            character = translate(translate(code, _CODE_TO_KEY), _KEY_TO_CHARACTER)
            signs[place] = capital(chr(character & 0xFFFF))
    return {place: sign for place, sign in signs.items() if sign}
