"""`paravol replay --window`: a recorded session in the trainee's window."""

from pathlib import Path
from types import FrameType

from app.cli.replay_options import ReplayOptions
from app.cli.train import EDGE_SAMPLES, errors_of_slots, on_interrupt
from app.opengl import probe_window
from disk import UserError


def run_replay_window(folder: Path, options: ReplayOptions) -> int:
    """Show a session, and the one beside it, until the window is closed.

    UserError where no window can open; a bundle that cannot be shown is told there.
    KeyboardInterrupt after Ctrl-C.
    """
    graphics = probe_window()
    if not graphics.works:
        raise UserError(graphics.problem)

    # Only here: where libraries are missing, loading Qt fails.
    from PySide6.QtWidgets import QApplication

    from app.window.main_window import MainWindow
    from app.window.replay.replay_page import ReplayPage
    from paravol.replay.replay_worker import ReplayOrder

    application = QApplication(["paravol"])
    window = MainWindow()
    page = ReplayPage(edge_samples=0 if graphics.is_software else EDGE_SAMPLES)
    page.left.connect(window.shut)
    page.full_screen_wanted.connect(window.full_screen.switch)
    window.dropped.connect(page.open)
    interrupted = False

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True
        window.shut()

    with errors_of_slots(window.shut) as errors, on_interrupt(interrupt):
        window.show_page(page)
        window.show()
        page.replay(
            ReplayOrder(
                folder, options.beside, options.case, threads=options.threads or None
            )
        )
        application.exec()
    window.release()
    if errors:
        raise errors[0]
    if interrupted:
        raise KeyboardInterrupt
    return 0
