"""Qt in the test's own process: one application, as it allows no second one."""

import gc
from collections.abc import Iterator

import pytest
from PySide6.QtWidgets import QApplication

from app.window.application import collect_garbage_here


@pytest.fixture(scope="session")
def application() -> Iterator[QApplication]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("QT_QPA_PLATFORM", "offscreen")
        # the texts that are compared are English, whatever the system speaks
        patch.setenv("LC_ALL", "C.UTF-8")
        application = QApplication(["test"])
        collect_garbage_here(application)
        yield application


@pytest.fixture(autouse=True, scope="module")
def garbage_of_widgets() -> Iterator[None]:
    """Let widgets that hang on cycles end in this thread, as in a program."""
    gc.disable()
    yield
    gc.collect()
    gc.enable()
