"""Whoever switches arms quickly, or leaves, waits for none that does not answer."""

import pytest

pytest.importorskip(
    "PySide6.QtCore", reason="the extra 'desktop'", exc_type=ImportError
)

from tests.app.window.opened_window import run_script

SWITCH = """
import threading
from PySide6.QtCore import QCoreApplication, QEvent
from app.window.connection import arm_thread

opened, answers, looked = [], threading.Event(), threading.Event()

def watch(self, port, closed):
    opened.append(port)
    looked.set()
    if port == "dead":
        answers.wait(60.0)

arm_thread.ArmThread._watch = watch
application = QCoreApplication([])
arm = arm_thread.ArmThread()
gone = []
arm.destroyed.connect(lambda: gone.append(True))
arm.watch("dead")
assert looked.wait(60.0)
# the dead port has its one user, and what is at another does not wait for it
for _ in range(3):
    arm.watch("dead")
looked.clear()
arm.watch("alive")
assert looked.wait(60.0)
arm.leave()
assert not answers.is_set() and opened == ["dead", "alive"]
answers.set()
while not gone:
    application.processEvents()
    application.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
print(opened)
"""


def test_an_arm_that_was_left_meanwhile_is_not_opened() -> None:
    assert run_script(SWITCH, limit_s=60.0) == "['dead', 'alive']\n"
