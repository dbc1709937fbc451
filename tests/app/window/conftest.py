"""Qt in the test's own process: one application, as it allows no second one."""

from collections.abc import Iterator

import pytest
from PySide6.QtWidgets import QApplication


@pytest.fixture(scope="session")
def application() -> Iterator[QApplication]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("QT_QPA_PLATFORM", "offscreen")
        # the texts that are compared are English, whatever the system speaks
        patch.setenv("LC_ALL", "C.UTF-8")
        yield QApplication(["test"])
