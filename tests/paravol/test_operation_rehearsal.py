"""Every exercise is rehearsed and begins, through the flight that the window flies."""

from pathlib import Path

import msgspec
import pytest

from paravol.flight import Flight, FlightObserver, FlightOrder
from paravol.flight_loop import FrameEvent
from paravol.inputs import choose_input
from scenarios import Scenario, load_scenario
from scenarios.scenario import CURRICULUM

NAMES = sorted(file.stem for file in CURRICULUM.glob("*.toml"))
FAST = ("diagnostic-left-concha", "diagnostic-right", "hoops", "uncinectomy")
FRAMES = 3


class Short(FlightObserver):
    """Ends the flight after its first frames."""

    def __init__(self) -> None:
        self.flight: Flight | None = None
        self.frames = 0

    def on_frame(self, event: FrameEvent) -> None:
        self.frames += 1
        assert self.flight is not None
        if self.frames == FRAMES:
            self.flight.end()


def coarse(name: str) -> tuple[Scenario, Path]:
    """Return an exercise on a head that is built in seconds."""
    scenario, folder = load_scenario(name)
    head = msgspec.structs.replace(scenario.head, spacing_mm=1.0)
    return msgspec.structs.replace(scenario, head=head), folder


@pytest.mark.parametrize(
    "name",
    [n if n in FAST else pytest.param(n, marks=pytest.mark.slow) for n in NAMES],
)
def test_an_exercise_begins(name: str, tmp_path: Path) -> None:
    """Prepared, rehearsed on a piece of its head, and its first frames flown."""
    scenario, folder = coarse(name)
    mouse = choose_input(None, None, scenario, None, folder / f"{name}.toml")
    order = FlightOrder(scenario, None, mouse, 48, 1, tmp_path / "flight.paravol")
    observer = Short()
    flight = observer.flight = Flight(order, observer)
    assert flight.run() is not None
    assert observer.frames >= FRAMES
