"""A desk with places of its own for all that it keeps, and a way to wait for it."""

import gc
import threading
import time
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QEvent, QEventLoop, QTimer
from PySide6.QtWidgets import QWidget

from app.window.main_window import MainWindow
from app.window.navigator import Navigator, NavigatorOrder
from paravol.exercises.training_setup import DeviceSetup, TrainingSetup
from paravol.sessions.session_store import SessionStore


def delete(*widgets: QWidget) -> None:
    """End widgets here and now: garbage collection might do so in any thread."""
    for widget in widgets:
        widget.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    gc.collect()


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


def waits_of_the_window(begun: Callable[[], object]) -> list[str]:
    """Return a list that will name each thread that this thread waits for.

    begun: called before each wait. Nothing takes it back but a test that patched
    `Thread.join` before.
    """
    waits: list[str] = []
    here, join = threading.current_thread(), threading.Thread.join

    def watched(self: threading.Thread, timeout: float | None = None) -> None:
        if threading.current_thread() is here:
            waits.append(self.name)
            begun()
        join(self, timeout)

    threading.Thread.join = watched  # type: ignore[method-assign]
    return waits


def opened_desk(folder: Path, devices: DeviceSetup | None = None) -> Navigator:
    """Return a desk whose window is not shown yet."""
    gc.collect()  # what other tests left, before there are threads
    setup = TrainingSetup(
        devices=devices or DeviceSetup(),
        size=64,
        threads=1,
        sessions=SessionStore(folder / "sessions"),
    )
    order = NavigatorOrder(
        setup,
        store=folder / "progress.sqlite",
        choices=folder / "trainee.json",
        has_typed_devices=devices is not None,
    )
    return Navigator(MainWindow(), order)
