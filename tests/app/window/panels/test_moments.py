"""A moment kept in the window is drawn beside the flight, grows, and is saved."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.app.window.opened_window import run_script

pytestmark = [pytest.mark.display, pytest.mark.slow]

LIMIT_S = 280.0

KEEP = """
import sys
from pathlib import Path
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from tests.app.window.opened_window import OpenedWindow

size, record = int(sys.argv[2]), Path(sys.argv[3])
opened = OpenedWindow(sys.argv[1], size=size, record=record)
flight, window, until = opened.flight, opened.window, opened.until
page = opened.page
frames, told = [], []
flight.arrived.connect(lambda: frames.append(0))
flight.pictured.connect(told.append)
opened.start()
assert not page._moments.isVisible()
QTest.keyClick(page, Qt.Key.Key_Space)
until("something to see", lambda: any(t.pixels is not None for t in told))
window.grab().save(sys.argv[4])
before = len(frames)
until("the end", lambda: told[-1].done is None)
window.grab().save(sys.argv[5])
until("live frames", lambda: len(frames) > before)
print(page._moments.caption)
opened.close()
"""


def test_a_kept_moment_grows_and_is_saved(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    record = tmp_path / "flight.paravol"
    shots = tmp_path / "growing.png", tmp_path / "saved.png"
    said = run_script(KEEP, coarse_scenario, 256, record, *shots, limit_s=LIMIT_S)
    (file,) = (record / "snapshots").iterdir()
    assert file.name in said
    with Image.open(file) as picture:
        saved = np.asarray(picture)
    assert saved.shape == (256, 256, 3)
    assert saved.std() > 5
    growing, final = (np.asarray(Image.open(shot).convert("RGB")) for shot in shots)
    assert growing.shape == final.shape
    assert (growing != final).any()
