"""Tables for spreadsheets, in which text from outside is text."""

import csv
from collections.abc import Iterable
from typing import TextIO

from system.plain_text import plain

_FORMULAS = ("=", "+", "-", "@", "\t", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""What a spreadsheet takes for a formula's beginning, full width included."""


class CsvTable:
    """Write rows to a stream; a text that begins as a formula does gets a mark."""

    def __init__(self, stream: TextIO, ending: str = "\n") -> None:
        self._writer = csv.writer(stream, lineterminator=ending)

    def add(self, row: Iterable[object]) -> None:
        """Write a row; numbers may be texts already."""
        self._writer.writerow([_plain(c) if isinstance(c, str) else c for c in row])


def _plain(text: str) -> str:
    # a lone carriage return would end a row in some programs
    text = plain(text)
    if not text.startswith(_FORMULAS):
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text
