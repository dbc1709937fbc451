"""A moment kept in the window is drawn beside the flight, grows, and is saved."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

pytestmark = [pytest.mark.display, pytest.mark.slow]

ROOT = Path(__file__).parents[2]
LIMIT_S = 280.0

KEEP = """
import sys, time
from pathlib import Path
from PySide6.QtCore import QEventLoop, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment
prepare_environment()
from paravol.inputs import choose_input
from app.window.main_window import TraineeWindow
from paravol.flight import FlightOrder
from app.window.flight_thread import FlightThread
from devices import load_probe_path
from scenarios import load_scenario

application = QApplication([])
scenario, folder = load_scenario(sys.argv[1])
size, record = int(sys.argv[2]), Path(sys.argv[3])
file = folder / scenario.path
path = load_probe_path(file)
mouse = choose_input("mouse", None, scenario, path, file)
flight = FlightThread(FlightOrder(scenario, path, mouse, size, 1, record))
window = TraineeWindow(flight, edge_samples=0)
frames, told = [], []
flight.arrived.connect(lambda: frames.append(0))
flight.pictured.connect(told.append)
window.show()
flight.start()

def until(what, holds):
    began = time.monotonic()
    while flight.error is None and not holds():
        assert time.monotonic() - began < 200.0, (what, told[-1:])
        loop = QEventLoop()
        QTimer.singleShot(20, loop.quit)
        loop.exec()
    assert flight.error is None, flight.error

until("a frame", lambda: frames)
assert not window._moments.isVisible()
QTest.keyClick(window, Qt.Key.Key_Space)
until("something to see", lambda: any(t.pixels is not None for t in told))
window.grab().save(sys.argv[4])
before = len(frames)
until("the end", lambda: told[-1].done is None)
window.grab().save(sys.argv[5])
until("live frames", lambda: len(frames) > before)
print(window._moments.caption)
window.close()
assert flight.stop(60.0)
window.release()
"""


def test_a_kept_moment_grows_and_is_saved(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    record = tmp_path / "flight.paravol"
    shots = tmp_path / "growing.png", tmp_path / "saved.png"
    words = [str(coarse_scenario), "256", str(record), *map(str, shots)]
    done = subprocess.run(
        [sys.executable, "-c", KEEP, *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
    )
    assert (done.returncode, done.stderr) == (0, "")
    (file,) = (record / "snapshots").iterdir()
    assert file.name in done.stdout
    with Image.open(file) as picture:
        saved = np.asarray(picture)
    assert saved.shape == (256, 256, 3)
    assert saved.std() > 5
    growing, final = (np.asarray(Image.open(shot).convert("RGB")) for shot in shots)
    assert growing.shape == final.shape
    assert (growing != final).any()
