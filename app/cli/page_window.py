"""Show one page in a window of its own, until it is closed."""

from collections.abc import Callable
from types import FrameType
from typing import TYPE_CHECKING

from app.cli.train import EDGE_SAMPLES, errors_of_slots, on_interrupt
from app.opengl import probe_window
from disk import UserError

if TYPE_CHECKING:
    from app.window.main_window import MainWindow
    from app.window.page import Page


def run_page(
    make: "Callable[[MainWindow, int], tuple[Page, Callable[[], object]]]",
) -> int:
    """Show a page; return when its window is closed.

    make: given the window, and samples a pixel for smooth edges, makes the page and
    what begins once it is shown. UserError where no window can open, KeyboardInterrupt
    after Ctrl-C.
    """
    graphics = probe_window()
    if not graphics.works:
        raise UserError(graphics.problem)

    # Only here: where libraries are missing, loading Qt fails.
    from app.window.application import make_application
    from app.window.main_window import MainWindow
    from paravol.window_preferences import read_preferences

    application = make_application()
    window = MainWindow(preferences=read_preferences())
    interrupted = False

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True
        window.shut()

    with errors_of_slots(window.tell) as errors, on_interrupt(interrupt):
        page, begin = make(window, 0 if graphics.is_software else EDGE_SAMPLES)
        page.left.connect(window.shut)
        window.show_page(page)
        window.show()
        begin()
        application.exec()
    window.release()
    if errors:
        raise errors[0]
    if interrupted:
        raise KeyboardInterrupt
    return 0
