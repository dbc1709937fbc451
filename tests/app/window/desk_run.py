"""A desk with places of its own for all that it keeps, and a way to wait for it."""

import time
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEventLoop, QTimer

from app.window.desk import Desk, DeskOrder
from app.window.main_window import MainWindow
from paravol.session_store import SessionStore
from paravol.training_setup import DeviceSetup, TrainingSetup


def wait(time_ms: int = 20) -> None:
    """Let events come in."""
    loop = QEventLoop()
    QTimer.singleShot(time_ms, loop.quit)
    loop.exec()


def until(what: str, holds: Callable[[], object], limit_s: float = 200.0) -> None:
    """Let events come in until something holds."""
    began = time.monotonic()
    while not holds():
        assert time.monotonic() - began < limit_s, what
        wait()


def opened_desk(folder: Path, devices: DeviceSetup | None = None) -> Desk:
    """Return a desk whose window is not shown yet."""
    setup = TrainingSetup(devices=devices or DeviceSetup(), size=64, threads=1)
    order = DeskOrder(
        setup,
        store=folder / "progress.sqlite",
        choices=folder / "trainee.json",
        sessions=SessionStore(folder / "sessions"),
        has_typed_devices=devices is not None,
    )
    return Desk(MainWindow(), order)
