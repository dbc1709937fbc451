"""Text from outside is text: what a file says of itself commands no terminal.

A title or a name may hold an escape sequence that moves the cursor, writes the
clipboard or hides a line. Every control character becomes one that can be seen.
"""

import io
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO, cast

from system.user_error import UserError

_KEPT = "\n\t"

_SHOWN = {n: chr(0x2400 + n) for n in range(32) if chr(n) not in _KEPT}
_SHOWN |= {0x7F: "\u2421"}
_SHOWN |= dict.fromkeys(range(0x80, 0xA0), "\ufffd")
# what turns the order of what follows, and what cannot be written at all
_SHOWN |= dict.fromkeys([*range(0x202A, 0x202F), *range(0x2066, 0x206A)], "\ufffd")
_SHOWN |= dict.fromkeys(range(0xD800, 0xE000), "\ufffd")


def plain(text: str) -> str:
    """Return text in which nothing commands a terminal, and which can be encoded."""
    return text if text.isprintable() else text.translate(_SHOWN)


def checked_name(path: Path | str) -> str:
    """Return a path as text; UserError where it is not UTF-8.

    Systems allow names of any bytes. Libraries in C++ end the process over them.
    """
    name = str(path)
    try:
        name.encode()
    except UnicodeEncodeError as error:
        raise UserError(
            f"{plain(name)} has a name, or lies in a folder with one, that is not "
            "UTF-8; rename it"
        ) from error
    return name


class PlainStream:
    """Pass text on to a stream as `plain` has it, in the letters that it can write.

    raw: that stream, for who writes commands of his own. All else is as it has it.
    """

    def __init__(self, raw: TextIO) -> None:
        self.raw = raw

    def write(self, text: str) -> int:
        """Write text; return how much of it."""
        told = plain(text.replace("\r\n", "\n"))
        encoding = self.raw.encoding or "utf-8"
        self.raw.write(told.encode(encoding, "replace").decode(encoding))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.raw, name)


@contextmanager
def plain_output() -> Iterator[None]:
    """Let standard output and error be plain meanwhile."""
    before = sys.stdout, sys.stderr
    for stream in before:
        # what a console of rich writes there goes past us
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    # a program without a terminal has none
    if sys.stdout is not None:
        sys.stdout = cast(TextIO, PlainStream(sys.stdout))
    if sys.stderr is not None:
        sys.stderr = cast(TextIO, PlainStream(sys.stderr))
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def raw_stream(stream: TextIO) -> TextIO:
    """Return the stream below, for who writes commands of his own."""
    own: TextIO = getattr(stream, "raw", stream)
    return own if isinstance(stream, PlainStream) else stream
