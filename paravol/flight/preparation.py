"""Work that a flight's preparation does beside the rest, in a thread of its own."""

import threading
from collections.abc import Callable

LOOKED_EVERY_S = 0.1
"""While it is waited for, between two looks at whether it still is wanted."""


class Preparation:
    """Do something beside; `wait` for it before what needs it."""

    def __init__(self, work: Callable[[], object]) -> None:
        """Begin."""
        self._work = work
        self._error: Exception | None = None
        # A daemon: a kernel that is just being compiled must not keep the program.
        self._thread = threading.Thread(
            target=self._run, name="preparation", daemon=True
        )
        self._thread.start()

    def wait(self, still: Callable[[], object]) -> None:
        """Wait for the end; an error of the work is raised.

        still: called now and then meanwhile; what it raises ends the waiting.
        """
        while self._thread.is_alive():
            still()
            self._thread.join(LOOKED_EVERY_S)
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        try:
            self._work()
        except Exception as error:
            self._error = error
