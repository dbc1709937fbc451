"""The end of threads that a page has begun: whoever leaves it waits for none."""

import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress

from PySide6.QtCore import QCoreApplication, QObject

PATIENCE_S = 5.0


def begin_ending(left: QObject, stop: Callable[[float], bool]) -> threading.Thread:
    """Stop threads beside the window; return the thread that waits for them.

    left: what they tell the window by. It ends with them, in the window's thread as it
    began there: Python's garbage collection might end it in any. stop: is given how
    long to wait, s, and returns whether all had ended by then.
    """
    left.setParent(QCoreApplication.instance())

    def end() -> None:
        while not stop(PATIENCE_S):
            # it is still compiling, or the machine is busy: it speaks once more
            pass
        # where the program ended meanwhile, it is gone already
        with suppress(RuntimeError):
            left.deleteLater()

    ending = threading.Thread(target=end, name="ending", daemon=True)
    ending.start()
    return ending


def wait_for(endings: Iterable[threading.Thread]) -> None:
    """Wait until all have ended, `PATIENCE_S` at most."""
    until_s = time.monotonic() + PATIENCE_S
    for ending in endings:
        ending.join(max(until_s - time.monotonic(), 0.0))
