"""What was typed in the terminal so far, without waiting for more."""

import os
import select
import sys

_READ_BYTES = 4096


def typed_text() -> str | None:
    """Return what was typed since the last call, None at the end of the input.

    Nothing waits in a buffer of ours, so that a later question finds its answer.
    """
    if sys.platform == "win32":
        import msvcrt

        typed = ""
        while msvcrt.kbhit():
            typed += msvcrt.getwche()
        return typed.replace("\r", "\n")
    standard = sys.stdin.fileno()
    readable, _, _ = select.select([standard], [], [], 0.0)
    if not readable:
        return ""
    data = os.read(standard, _READ_BYTES)
    return data.decode(errors="replace") if data else None
