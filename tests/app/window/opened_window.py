"""The window of a flight, opened and steered by a script in a process of its own.

What a script does not close would stay with the tests; what it prints they read.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
LIMIT_S = 240.0


def run_script(script: str, *words: object, limit_s: float = LIMIT_S) -> str:
    """Run a script with words as its arguments; return what it prints."""
    done = subprocess.run(
        [sys.executable, "-c", script, *map(str, words)],
        cwd=ROOT,
        # the texts that are read are English, whatever the system speaks
        env=os.environ | {"LC_ALL": "C.UTF-8"},
        capture_output=True,
        text=True,
        timeout=limit_s,
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    return done.stdout


class OpenedWindow:
    """Show a scenario's window and keep each instant that it takes."""

    def __init__(
        self,
        scenario_name: str,
        given_input: str | None = "mouse",
        size: int = 128,
        record: Path | None = None,
        device: str | None = None,
    ) -> None:
        """Open it; the flight begins with `start`."""
        # Imported here: the tests themselves open no window.
        from PySide6.QtWidgets import QApplication

        from paravol.environment import prepare_environment

        prepare_environment()
        from app.window.flight.flight_page import FlightPage
        from app.window.flight.flight_thread import FlightThread
        from app.window.main_window import MainWindow
        from app.window.session_thread import FrameReady
        from devices import load_probe_path
        from paravol.flight.flight import FlightOrder
        from paravol.inputs import choose_input
        from scenarios import load_scenario

        self.application = QApplication([])
        scenario, folder = load_scenario(scenario_name)
        file = folder / scenario.path
        path = load_probe_path(file)
        chosen = choose_input(given_input, device, scenario, path, file)
        order = FlightOrder(scenario, path, chosen, size, 1, record)
        self.flight = FlightThread(order)
        self.window = MainWindow()
        self.page = FlightPage(self.flight, edge_samples=0)
        self.page.left.connect(self.window.shut)
        self.seen: list[Any] = []
        self.told: list[Any] = []
        self.arrived_s: list[float] = []
        """When there was a new frame."""

        def hear(event: object) -> None:
            if isinstance(event, FrameReady):
                self.arrived_s.append(time.monotonic())
            else:
                self.told.append(event)

        self.flight.told.connect(hear)
        self._take = self.flight.take
        self.flight.take = self._watched  # type: ignore[method-assign]
        self.window.show_page(self.page)
        self.window.show()

    def _watched(self) -> Any:
        instant = self._take()
        if instant is not None:
            self.seen.append(instant)
        return instant

    def start(self) -> None:
        """Begin the flight; return with its first frame."""
        self.flight.start()
        self.until("a frame", lambda: True)

    def wait(self, time_ms: int = 20) -> None:
        """Let events come in; QTest.qWait would keep the interpreter for itself."""
        from PySide6.QtCore import QEventLoop, QTimer

        loop = QEventLoop()
        QTimer.singleShot(time_ms, loop.quit)
        loop.exec()

    def until(self, what: str, holds: Callable[[], object]) -> None:
        """Let the flight go on until something holds of a new frame."""
        count, began = -1, time.monotonic()
        while self.flight.error is None and (
            len(self.seen) in (0, count) or not holds()
        ):
            count = len(self.seen)
            assert time.monotonic() - began < 200.0, (what, count, self.seen[-1:])
            self.wait()
        assert self.flight.error is None, self.flight.error

    def close(self) -> None:
        """Close the window, end the flight, and give back what they hold."""
        self.window.shut()
        assert self.flight.stop(60.0)
        self.window.release()
