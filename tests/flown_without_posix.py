"""Flies twice where POSIX is missing: with the mouse, then the emulated arm.

    python tests/flown_without_posix.py SCENARIO STORE

`test_portability` runs it in a process that hides POSIX. It prints one line of JSON.
"""

import json
import sys
import time
from pathlib import Path

from app.cli.root import thread_count
from devices.microscribe.emulator.emulator_client import MicroScribeEmulator
from paravol.exercises.exercise_path import recorded_path, recorded_path_file
from paravol.flight.flight import Flight, FlightOrder
from paravol.flight.flight_events import FlightEvent
from paravol.flight.flight_loop import FrameEvent
from paravol.inputs import choose_input
from paravol.inputs.hand import MouseInput
from paravol.sessions.session_store import SessionStore
from scenarios import load_scenario

FRAMES = 12


class Pilot:
    """Push the mouse's scope in while frames come, and end after some."""

    def __init__(self) -> None:
        self.flight: Flight | None = None
        self.depths: list[float] = []

    def hear(self, event: FlightEvent) -> None:
        """Turn the wheel with each frame."""
        if not isinstance(event, FrameEvent):
            return
        assert self.flight is not None
        steered = self.flight.order.input
        if isinstance(steered, MouseInput) and steered.controls is not None:
            steered.controls.wheel(1.0, time.monotonic())
        self.depths.append(float(event.view.world_from_tip[1, 3]))
        if event.number >= FRAMES:
            self.flight.end()


def fly(words: str, scenario_file: str, store: SessionStore) -> dict[str, object]:
    """Fly through the head with this input; say what came of it."""
    scenario, folder = load_scenario(scenario_file)
    path = recorded_path(scenario, folder)
    file = recorded_path_file(scenario, folder)
    flown = choose_input(words, None, scenario, path, file)
    pilot = Pilot()
    order = FlightOrder(scenario, path, flown, 64, thread_count(1), None, kept=store)
    pilot.flight = Flight(order, pilot.hear)
    finished = pilot.flight.run()
    assert finished is not None
    assert pilot.flight.result is not None
    return {
        "frames": len(pilot.depths),
        "moved_mm": abs(pilot.depths[-1] - pilot.depths[0]),
        "residual_mm": finished.info.registration_rms_mm,
        "record": str(pilot.flight.result.record),
        "duration_s": finished.score.duration_s,
    }


def main(scenario_file: str, store: Path) -> None:
    """Fly both and print what came of it."""
    kept = SessionStore(store)
    found = {words: fly(words, scenario_file, kept) for words in ("mouse", "emulator")}
    scenario, folder = load_scenario(scenario_file)
    with MicroScribeEmulator(folder / scenario.path) as emulator:
        port = emulator.port_name
    print(json.dumps({"flights": found, "port": port}))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
