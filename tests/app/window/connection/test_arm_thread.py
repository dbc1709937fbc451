"""Whoever switches arms quickly, or leaves, waits for none that does not answer."""

import threading

import pytest

pytest.importorskip(
    "PySide6.QtCore", reason="the extra 'desktop'", exc_type=ImportError
)

from PySide6.QtCore import QCoreApplication, QEvent
from PySide6.QtWidgets import QApplication

from app.window.connection.arm_thread import ArmThread
from tests.app.window.desk_run import until


def test_an_arm_that_was_left_meanwhile_is_not_opened(
    application: QApplication, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str | None] = []
    answers, looked = threading.Event(), threading.Event()

    def watch(arm: ArmThread, port: str | None, closed: threading.Event) -> None:
        opened.append(port)
        looked.set()
        if port == "dead":
            answers.wait(60.0)

    monkeypatch.setattr(ArmThread, "_watch", watch)
    arm, gone = ArmThread(), list[bool]()
    arm.destroyed.connect(lambda: gone.append(True))
    arm.watch("dead")
    assert looked.wait(60.0)
    # the dead port has its one user, and what is at another does not wait for it
    for _ in range(3):
        arm.watch("dead")
    looked.clear()
    arm.watch("alive")
    assert looked.wait(60.0)
    ending = arm.leave()
    assert not answers.is_set()
    answers.set()
    ending.join(60.0)
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
    until("an end", lambda: gone, 60.0)
    assert opened == ["dead", "alive"]
