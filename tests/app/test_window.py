"""The whole window as a trainee uses it; see `tests/app/window/journey.py`."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.flights import virtual_screen

ROOT = Path(__file__).parents[2]
JOURNEY = "tests/app/window/journey.py"


def walk(way: str, limit_s: float) -> None:
    """Go one way in a process of its own: Qt allows one application in each.

    It fails on any warning of Qt, and on anything on the standard error.
    """
    command = [sys.executable, "-m", "pytest", "-p", "pytestqt.plugin", "-s", "-q"]
    command += ["-p", "no:cacheprovider", "-o", "qt_log_level_fail=WARNING"]
    command += [f"--timeout={limit_s:.0f}", f"{JOURNEY}::{way}"]
    with virtual_screen(3840, 2160):
        environment = os.environ | {"QT_QPA_PLATFORM": "xcb"}
        done = subprocess.run(
            command,
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=limit_s + 30.0,
        )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout[-6000:]
    assert "1 passed" in done.stdout


@pytest.mark.display
@pytest.mark.timeout(460)
def test_one_flies_and_comes_back_home() -> None:
    walk("test_short_way", 420.0)


@pytest.mark.display
@pytest.mark.slow
@pytest.mark.timeout(700)
def test_one_goes_through_every_page_by_clicks_and_keys() -> None:
    walk("test_whole_way", 600.0)
