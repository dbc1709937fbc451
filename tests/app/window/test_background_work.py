"""Slow work beside the window, told in the window's own thread."""

import threading

import pytest
from PySide6.QtWidgets import QApplication

from app.window.background_work import BackgroundWork, words_for
from paravol.patient import Progress
from system import UserError
from tests.app.window.desk_run import until


def test_work_is_told_in_the_thread_of_the_window(application: QApplication) -> None:
    told: list[tuple[object, ...]] = []
    threads: set[str] = set()

    def work(progress: Progress) -> str:
        threads.add(threading.current_thread().name)
        for share in (0.0, 0.0001, 0.5, 1.0):
            progress("Looking", share)
        return "found"

    begun = BackgroundWork(work)
    here = threading.current_thread().name
    begun.staged.connect(
        lambda *stage: told.append((*stage, threading.current_thread().name))
    )
    begun.done.connect(
        lambda found: told.append((found, threading.current_thread().name))
    )
    begun.start()
    until("an end", lambda: told and told[-1][0] == "found", 20.0)
    assert threads == {"work"}
    assert {each[-1] for each in told} == {here}
    assert [each[1] for each in told[:-1]] == [0.0, 0.5, 1.0]


def test_the_window_goes_on_while_work_waits(application: QApplication) -> None:
    gate = threading.Event()
    ended: list[object] = []
    begun = BackgroundWork(lambda _: gate.wait(20.0))
    begun.done.connect(ended.append)
    begun.start()
    turns = iter(range(6))
    until("turns", lambda: next(turns) == 5, 20.0)
    assert not ended
    gate.set()
    until("an end", lambda: ended, 20.0)
    assert ended == [True]


def test_what_fails_is_told_in_a_sentence(
    application: QApplication, capfd: pytest.CaptureFixture[str]
) -> None:
    told: list[str] = []

    def refuse(progress: Progress) -> None:
        raise UserError("There is no such case; choose another.")

    begun = BackgroundWork(refuse)
    begun.failed.connect(told.append)
    begun.start()
    until("a failure", lambda: told, 20.0)
    assert told == ["There is no such case; choose another."]
    assert capfd.readouterr().err == ""


def test_a_defect_of_ours_keeps_its_traceback(
    capfd: pytest.CaptureFixture[str],
) -> None:
    assert "KeyError: 'nothing'" in words_for(KeyError("nothing"))
    assert "KeyError" in capfd.readouterr().err
