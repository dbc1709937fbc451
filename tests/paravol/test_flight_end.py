"""A flight's end: asked for, told, and on disk, whoever flies."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from app.__main__ import main

pytestmark = [pytest.mark.display, pytest.mark.slow]

ROOT = Path(__file__).parents[2]
Train = Callable[..., tuple[subprocess.CompletedProcess[str], list[int]]]

TARGETS = 4


@pytest.mark.parametrize("words", [[], ["--input", "emulator"]])
def test_a_flight_that_nobody_named_is_recorded_and_told(
    words: list[str],
    train: Train,
    coarse_scenario: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    done, left = train("--scenario", str(coarse_scenario), "--seconds", "2", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert not left
    (folder,) = (tmp_path / "paravol" / "sessions").iterdir()
    told = done.stdout
    assert f"Recorded in {folder}\n" in told
    assert f"paravol replay {folder}\n" in told
    for figure in ("path length", "smallest clearance", "contacts"):
        assert figure in told
    assert told.count("nearest to ") == TARGETS
    session = json.loads((folder / "session.json").read_text())
    assert session["automatic"] is True
    # The mouse steers where nobody says otherwise, and it holds no suction tube.
    assert session["has_instrument"] is bool(words)
    result = json.loads((folder / "result.json").read_text())
    assert len(result["score"]["target_distance_mm"]) == TARGETS
    assert result["timing"]["frames"] > 0
    if not words:
        assert main(["replay", str(folder), "--check"]) == 0


def test_a_flight_that_cannot_be_kept_goes_on_and_says_so(
    train: Train,
    coarse_scenario: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "paravol").write_text("a file where the folder should be")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    done, _ = train("--scenario", str(coarse_scenario), "--seconds", "1")
    assert (done.returncode, done.stderr) == (0, "")
    assert "path length" in done.stdout
    assert "Not recorded:" in done.stdout


ASK = """
import sys, time
from pathlib import Path
from PySide6.QtCore import QEventLoop, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from paravol.environment import prepare_environment
prepare_environment()
from paravol.flight_order import FlightOrder
from paravol.inputs import choose_input
from app.window.main_window import TraineeWindow
from app.window.flight_thread import WindowFlight
from devices import load_probe_path
from scenarios import load_scenario

application = QApplication([])
scenario, folder = load_scenario(sys.argv[1])
path = load_probe_path(folder / scenario.path)
mouse = choose_input(None, None, scenario, path, folder / scenario.path)
record = Path(sys.argv[2])
flight = WindowFlight(FlightOrder(scenario, path, mouse, 64, 1, record))
window = TraineeWindow(flight, None, edge_samples=0)
frames = []
flight.arrived.connect(lambda: frames.append(0))
said = []
say = window.picture.say
def spoken(message, detail="", share=None):
    said.append(message)
    say(message, detail, share)
window.picture.say = spoken
window.show()
flight.start()

def until(what, holds):
    began = time.monotonic()
    while flight.error is None and not holds():
        assert time.monotonic() - began < 200.0, what
        loop = QEventLoop()
        QTimer.singleShot(20, loop.quit)
        loop.exec()
    assert flight.error is None, flight.error

def asked():
    return window.isVisible() and said[-1] == "End this flight?"

until("a frame", lambda: frames)
for key in (Qt.Key.Key_Q, Qt.Key.Key_Escape):
    QTest.keyClick(window, key)
    assert asked(), said
    # The flight goes on under the question, and notices do not hide it.
    QTest.keyClick(window, Qt.Key.Key_M)
    count = len(frames)
    until("more frames", lambda: len(frames) > count + 2)
    assert asked(), said
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert said[-1] == "" and window.isVisible()
QTest.keyClick(window, Qt.Key.Key_Return)  # answers nothing
count = len(frames)
until("more frames", lambda: len(frames) > count + 2)
# By the mouse: the window's own button asks, too.
window.close()
assert asked(), said
QTest.keyClick(window, Qt.Key.Key_Return)
until("the end", lambda: window.picture._result is not None)
assert window.isVisible()
assert flight.end.title == "The flight is over"
assert len(flight.end.score.target_distance_mm) == 4
window.grab().save(sys.argv[3])
QTest.keyClick(window, Qt.Key.Key_Q)
assert not window.isVisible()
assert flight.stop(60.0)
window.release()
"""


def test_q_and_escape_ask_and_the_end_shows_the_result(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    record = tmp_path / "flight.paravol"
    done = subprocess.run(
        [
            *(sys.executable, "-c", ASK),
            *(str(coarse_scenario), str(record), str(tmp_path / "end.png")),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=240.0,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert (record / "result.json").is_file()
    assert json.loads((record / "session.json").read_text())["automatic"] is False
