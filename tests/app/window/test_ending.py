"""What is left goes on beside the window until its threads have ended."""

import threading
from functools import partial

import pytest
from PySide6.QtCore import QObject
from PySide6.QtWidgets import QApplication

from app.window.ending import begin_ending, wait_for
from tests.app.window.desk_run import until


def test_what_takes_long_to_end_is_there_until_it_has(
    application: QApplication,
) -> None:
    told: list[object] = []

    def stop(patience_s: float) -> bool:
        told.append("stopped")
        return len(told) == 3

    left = QObject()
    # called in the thread that the object ends in
    left.destroyed.connect(lambda: told.append(threading.current_thread()))
    ending = begin_ending(left, stop)
    del left
    wait_for([ending])
    until("its end", lambda: len(told) > 3)
    assert told == ["stopped"] * 3 + [threading.main_thread()]


def test_the_end_of_the_program_waits_but_not_for_ever(
    application: QApplication, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.window.ending.PATIENCE_S", 0.3)
    begun, may_end = threading.Event(), threading.Event()

    def stop(patience_s: float) -> bool:
        begun.set()
        return may_end.wait(60.0)

    gone = threading.Event()
    left = QObject()
    left.destroyed.connect(partial(gone.set))
    ending = begin_ending(left, stop)
    assert begun.wait(60.0)
    wait_for([ending])
    assert ending.is_alive()
    may_end.set()
    until("its end", gone.is_set)
