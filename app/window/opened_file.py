"""Files that other programs of the desktop open."""

import subprocess
import sys
from pathlib import Path

LINUX = "linux"
PATIENCE_S = 10.0
"""A program that is still there after so long has opened."""


def open_file(file: Path) -> bool:
    """Have the desktop open a file or folder; return whether a program did.

    It may take a second: call it beside the window. What such programs write stays off
    the terminal.
    """
    if sys.platform != LINUX:
        from PySide6.QtCore import QUrl
        from PySide6.QtGui import QDesktopServices

        return QDesktopServices.openUrl(QUrl.fromLocalFile(str(file)))
    quiet = subprocess.DEVNULL
    try:
        opener = subprocess.Popen(
            ["xdg-open", str(file)], stdin=quiet, stdout=quiet, stderr=quiet
        )
        return opener.wait(PATIENCE_S) == 0
    except OSError:
        return False
    except subprocess.TimeoutExpired:
        return True
