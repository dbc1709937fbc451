"""Qt's application, of which a program has one."""

from PySide6.QtWidgets import QApplication

from machine import use_c_numbers


def make_application() -> QApplication:
    """Make the application; numbers of libraries keep their decimal point."""
    application = QApplication(["paravol"])
    use_c_numbers()
    return application
