"""The window's texts in the user's language: one catalogue, a file for each language.

The files are gettext's, which any tool for translators writes: ``locale/de.po`` holds
what `tr` is asked for in English, and says it in German. They are read as they are, so
that whoever changes one sees it at the next start.

What is made below the window is English wherever it goes: recordings keep it, reports
and commands print it. The window says it by its pattern, whose places are numbered:
``{0} of 100 points``. A place without a format holds words, which are said likewise.
"""

import ast
import re
from functools import lru_cache
from pathlib import Path

from PySide6.QtCore import QLocale

FOLDER = Path(__file__).parent / "locale"
LANGUAGES = {"en": "English", "de": "Deutsch"}
"""By their codes, as they call themselves; the first is that of the source."""

_ENTRY = re.compile(r'^msgid ((?:".*"\s*)+)^msgstr ((?:".*"\s*)+)', re.MULTILINE)
_QUOTED = re.compile(r'".*"')
_PLACE = re.compile(r"\{(\d+)(:[^}]*)?\}")
_WORD = re.compile(r"(?!m[mLs]\d?\b)[^\W\d_]{2,}")
_NUMBER = r"[-+]?(?:\d+(?:[.,]\d+)*(?:e[-+]?\d+)?|inf|nan)%?"
_SAID: dict[str, str] = {}
_PATTERNS: list[tuple[re.Pattern[str], str]] = []
"""Of texts with numbered places, and what is said for them; see `_telling`."""


def tr(text: str, /, **values: object) -> str:
    """Return a text in the user's language, with values in its braces.

    What has no translation is said as it is written.
    """
    said = _SAID.get(text) or _by_pattern(text)
    return said.format(**values) if values else said


@lru_cache(4096)
def _by_pattern(text: str) -> str:
    """Say a text that came with its values in it; unknown ones as they are."""
    found = ((pattern.fullmatch(text), said) for pattern, said in _PATTERNS)
    held, said = next((each for each in found if each[0]), (None, text))
    if held is None:
        return text
    words = {place: tr(word) for place, word in held.groupdict().items()}
    return _PLACE.sub(lambda place: words[f"p{place[1]}"], said)


def later(text: str, /) -> str:
    """Return a text as it is: `tr` is asked for it when it is shown."""
    return text


def take_language(code: str = "") -> None:
    """Say all that is asked for from now on in a language; "" for the system's."""
    code = code or QLocale.system().name().partition("_")[0]
    _SAID.clear()
    _PATTERNS.clear()
    file = FOLDER / f"{code}.po"
    if code in LANGUAGES and file.is_file():
        _SAID.update(read_po(file.read_text(encoding="utf-8")))
        _SAID.pop("")
    numbered = [text for text in _SAID if _PLACE.search(text) or text[0] in ",;"]
    numbered.sort(key=_telling, reverse=True)
    for text in numbered:
        # what begins like that is the end of another text
        before = "{99}" if text[0] in " ,;" else ""
        _PATTERNS.append((_pattern(before + text), before + _SAID[text]))
    _by_pattern.cache_clear()


def _telling(text: str) -> tuple[int, int, str]:
    """Rank a pattern by its words; of those without any, ";" parts before ":", ","."""
    rest = _PLACE.sub("", text)
    words = sum(map(len, _WORD.findall(rest)))
    return words, len(rest) if words else 0, text


def _pattern(text: str) -> re.Pattern[str]:
    told = ""
    parts = _PLACE.split(text)
    for before, place, form in zip(parts[0::3], parts[1::3], parts[2::3], strict=False):
        # what nothing parts from what is before it may be empty
        held = _NUMBER if form else ".+?" if before else ".*?"
        told += f"{re.escape(before)}(?P<p{place}>{held})"
    return re.compile(told + re.escape(parts[-1]), re.DOTALL)


def read_po(text: str) -> dict[str, str]:
    """Return what a file of gettext says, by what is said in English."""
    return {_joined(m[1]): _joined(m[2]) for m in _ENTRY.finditer(text)}


def _joined(lines: str) -> str:
    # a string of C is one of Python
    return "".join(ast.literal_eval(part) for part in _QUOTED.findall(lines))
