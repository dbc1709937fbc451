"""Qt's application, of which a program has one."""

import gc
import sys

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QApplication

from system import use_c_numbers

SWITCH_S = 0.001
"""For so long a thread keeps the interpreter while others wait, at most. The window
waits for each that works beside it, while kernels compile for three of them or more.
"""

COLLECTED_MS, OLDEST = 500, 50
"""Young garbage is looked for so often, what has lasted each eleventh time, and all
there is after the second of those: the compiler leaves half a million objects."""


def make_application() -> QApplication:
    """Make the application; numbers of libraries keep their decimal point."""
    sys.setswitchinterval(SWITCH_S)
    application = QApplication(["paravol"])
    collect_garbage_here(application)
    use_c_numbers()
    return application


def collect_garbage_here(parent: QObject) -> QTimer:
    """Collect cycles of garbage in this thread alone, as long as its parent lives.

    Python's own collector runs in whichever thread allocates next. Where widgets hang
    on a cycle, it would end them there, and Qt crashes, then or later.
    """
    gc.disable()
    timer = QTimer(parent)
    timer.timeout.connect(collect_due)
    timer.start(COLLECTED_MS)
    return timer


def collect_due() -> None:
    """Collect the oldest generation of garbage that is due."""
    _, collected, older = gc.get_count()
    if older > OLDEST:
        gc.collect(2)
    elif collected > gc.get_threshold()[1]:
        gc.collect(1)
    else:
        gc.collect(0)
