"""The window's texts in the user's language: one catalogue, a file for each language.

The files are gettext's, which any tool for translators writes: ``locale/de.po`` holds
what `tr` is asked for in English, and says it in German. They are read as they are, so
that whoever changes one sees it at the next start.
"""

import ast
import re
from pathlib import Path

from PySide6.QtCore import QLocale

FOLDER = Path(__file__).parent / "locale"
LANGUAGES = {"en": "English", "de": "Deutsch"}
"""By their codes, as they call themselves; the first is that of the source."""

_ENTRY = re.compile(r'^msgid ((?:".*"\s*)+)^msgstr ((?:".*"\s*)+)', re.MULTILINE)
_QUOTED = re.compile(r'".*"')
_SAID: dict[str, str] = {}


def tr(text: str, /, **values: object) -> str:
    """Return a text in the user's language, with values in its braces.

    What has no translation is said as it is written.
    """
    said = _SAID.get(text) or text
    return said.format(**values) if values else said


def later(text: str, /) -> str:
    """Return a text as it is: `tr` is asked for it when it is shown."""
    return text


def take_language(code: str = "") -> None:
    """Say all that is asked for from now on in a language; "" for the system's."""
    code = code or QLocale.system().name().partition("_")[0]
    _SAID.clear()
    file = FOLDER / f"{code}.po"
    if code in LANGUAGES and file.is_file():
        _SAID.update(read_po(file.read_text(encoding="utf-8")))


def read_po(text: str) -> dict[str, str]:
    """Return what a file of gettext says, by what is said in English."""
    return {_joined(m[1]): _joined(m[2]) for m in _ENTRY.finditer(text)}


def _joined(lines: str) -> str:
    # a string of C is one of Python
    return "".join(ast.literal_eval(part) for part in _QUOTED.findall(lines))
