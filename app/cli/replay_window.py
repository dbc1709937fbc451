"""`paravol replay --window`: a recorded session in the trainee's window."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.page_window import run_page
from app.cli.replay_options import ReplayOptions

if TYPE_CHECKING:
    from app.window.main_window import MainWindow
    from app.window.replay.replay_page import ReplayPage


def run_replay_window(folder: Path, options: ReplayOptions) -> int:
    """Show a session, and the one beside it; a bundle that cannot is told there."""

    def make(
        window: "MainWindow", edge_samples: int
    ) -> "tuple[ReplayPage, Callable[[], object]]":
        from app.window.replay.replay_page import ReplayPage
        from paravol.replays.replay_events import ReplayOrder

        page = ReplayPage(edge_samples=edge_samples)
        window.dropped.connect(page.open)
        order = ReplayOrder(
            folder, options.beside, options.case, threads=options.threads or None
        )
        return page, lambda: page.replay(order)

    return run_page(make)
