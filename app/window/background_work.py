"""Slow work beside the window: files, scores, devices, pages."""

import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from PySide6.QtCore import QObject, Signal, Slot

from app.errors import sentence
from app.window.texts import tr
from paravol.patient import Progress


class BackgroundWork(QObject):
    """Do something in a thread and tell the window, in the window's own thread."""

    staged = Signal(str, float)
    """What is being done, and its done share, 0 to 1."""
    done = Signal(object)
    """What came of it."""
    failed = Signal(str)
    """Why nothing came of it, in a sentence."""
    _ended = Signal(object, str)

    def __init__(
        self, work: Callable[[Progress], Any], parent: QObject | None = None
    ) -> None:
        """Take work; it is given a progress to report to.

        parent: keeps this object until its end was told. Without one whoever holds it
        does; Python's garbage collection might end it in any thread.
        """
        super().__init__(parent)
        self._work = work
        self._staged = ("", 0.0)
        # by way of the window's thread, whoever listens
        self._ended.connect(self._tell)
        # A daemon: what is not done when the window closes must not keep the program.
        self._thread = threading.Thread(target=self._run, name="work", daemon=True)

    def start(self) -> "BackgroundWork":
        """Begin, and return the work."""
        self._thread.start()
        return self

    def _run(self) -> None:
        # Where the window was closed meanwhile, nobody is left to be told.
        with suppress(RuntimeError):
            try:
                found = self._work(self._stage)
            except Exception as error:
                self._ended.emit(None, words_for(error))
            else:
                self._ended.emit(found, "")

    @Slot(object, str)
    def _tell(self, found: Any, problem: str) -> None:
        if problem:
            self.failed.emit(problem)
        else:
            self.done.emit(found)
        if self.parent() is not None:
            self.deleteLater()

    def _stage(self, stage: str, share: float) -> None:
        staged = stage, round(share, 2)
        if staged != self._staged:
            self._staged = staged
            self.staged.emit(tr(stage), share)


def words_for(error: BaseException) -> str:
    """Return what to tell of an error; of a defect of ours, standard error has more."""
    told = sentence(error) if isinstance(error, Exception) else None
    if told is not None:
        return tr(told)
    traceback.print_exception(error, file=sys.stderr)
    return tr(
        "The program made a mistake ({kind}: {error}).",
        kind=type(error).__name__,
        error=error,
    )
