"""Qt's application, of which a program has one."""

import sys

from PySide6.QtWidgets import QApplication

from system import use_c_numbers

SWITCH_S = 0.001
"""For so long a thread keeps the interpreter while others wait, at most. The window
waits for each that works beside it, while kernels compile for three of them or more.
"""


def make_application() -> QApplication:
    """Make the application; numbers of libraries keep their decimal point."""
    sys.setswitchinterval(SWITCH_S)
    application = QApplication(["paravol"])
    use_c_numbers()
    return application
