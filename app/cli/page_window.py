"""A window from its opening until it is closed, and a page in one of its own."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType, TracebackType
from typing import TYPE_CHECKING

from app.opengl import OpenGL, probe_window
from system import UserError

if TYPE_CHECKING:
    from app.window.main_window import MainWindow
    from app.window.page import Page
    from paravol.trainee.window_preferences import WindowPreferences

EDGE_SAMPLES = 8
"""For smooth edges, where a graphics card draws them."""


class OpenedWindow:
    """The window of a command, and what goes wrong while it is open.

    edge_samples: samples a pixel for smooth edges.
    """

    def __init__(
        self,
        graphics: OpenGL,
        screenshot: Path | None = None,
        looks: "WindowPreferences | None" = None,
    ) -> None:
        """Open it, empty; UserError where no window can open.

        screenshot, looks: see `MainWindow`; None for the looks that were chosen last.
        """
        if not graphics.works:
            raise UserError(graphics.problem)

        # Only here: where libraries are missing, loading Qt fails.
        from app.window.application import make_application
        from app.window.main_window import MainWindow
        from paravol.trainee.window_preferences import read_preferences

        self._application = make_application()
        self.window: MainWindow = MainWindow(screenshot, looks or read_preferences())
        self.edge_samples = 0 if graphics.is_software else EDGE_SAMPLES
        self._errors: list[BaseException] = []
        self._interrupts: list[KeyboardInterrupt] = []

    def run(self, begin: Callable[[], object]) -> None:
        """Begin something, and return when the window is closed."""

        def interrupt(number: int, frame: FrameType | None) -> None:
            self._interrupts.append(KeyboardInterrupt())
            self.window.shut()

        catching = errors_of_slots(self.window.tell)
        with catching as self._errors, on_interrupt(interrupt):
            begin()
            self._application.exec()

    def raise_problem(self, last: Exception | None = None) -> None:
        """Raise what went wrong first: in the window, then last, then by Ctrl-C."""
        for problem in (*self._errors, last, *self._interrupts):
            if problem is not None:
                raise problem


@contextmanager
def errors_of_slots(tell: Callable[[str], object]) -> Iterator[list[BaseException]]:
    """Gather what is raised below Qt, which would only print it; tell the first."""
    from app.window.background_work import words_for

    errors: list[BaseException] = []

    def hook(
        kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        errors.append(error)
        if len(errors) == 1:
            tell(words_for(error))

    before, sys.excepthook = sys.excepthook, hook
    try:
        yield errors
    finally:
        sys.excepthook = before


@contextmanager
def on_interrupt(
    handler: Callable[[int, FrameType | None], None],
) -> Iterator[None]:
    """Call `handler` on Ctrl-C.

    Python gets to it as soon as Qt calls Python next: the window's timer does, ten
    times a second.
    """
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def run_page(
    make: "Callable[[MainWindow, int], tuple[Page, Callable[[], object]]]",
) -> int:
    """Show a page; return when its window is closed.

    make: given the window, and samples a pixel for smooth edges, makes the page and
    what begins once it is shown. UserError where no window can open, KeyboardInterrupt
    after Ctrl-C.
    """
    opened = OpenedWindow(probe_window())
    window = opened.window

    def begin() -> None:
        page, go = make(window, opened.edge_samples)
        page.left.connect(window.shut)
        window.show_page(page)
        window.show()
        go()

    opened.run(begin)
    window.release()
    opened.raise_problem()
    return 0
