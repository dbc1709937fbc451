"""What takes a while to make is made anew in the background, now and then."""

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")

EVERY_S = 1.0
"""Between two makings, at least: they take part of a processor from the frames."""


class Refresher(Generic[T]):
    """Make something anew whenever that is asked for, but not more often than wanted.

    However often it was asked, a making begins after the last time.
    """

    def __init__(
        self,
        make: Callable[[], T],
        show: Callable[[T], None],
        every_s: float = EVERY_S,
    ) -> None:
        """Do nothing yet.

        make, show: called by a thread of the refresher's own. every_s: from the end of
            one making to the beginning of the next.
        """
        self._make = make
        self._show = show
        self._every_s = every_s
        self._closed = threading.Event()
        self._lock = threading.Lock()
        self._is_wanted = False
        self._thread: threading.Thread | None = None

    def ask(self) -> None:
        """Have it made; returns at once. May be called by any thread."""
        with self._lock:
            self._is_wanted = True
            if self._thread is None and not self._closed.is_set():
                self._thread = threading.Thread(
                    target=self._run, name="refresh", daemon=True
                )
                self._thread.start()

    def close(self) -> None:
        """Make no more; what is being made is not shown, and not waited for."""
        self._closed.set()

    def _run(self) -> None:
        while True:
            with self._lock:
                if not self._is_wanted or self._closed.is_set():
                    self._thread = None
                    return
                self._is_wanted = False
            made = self._make()
            if not self._closed.is_set():
                self._show(made)
            self._closed.wait(self._every_s)
