"""Every exercise is rehearsed and begins; whatever is done in a flight was compiled."""

from pathlib import Path

import msgspec
import pytest

from paravol.flight.flight import Flight, FlightOrder
from paravol.flight.flight_events import FlightEvent
from paravol.flight.flight_loop import FrameEvent
from paravol.inputs import choose_input
from scenarios import Scenario, load_scenario
from scenarios.scenario import CURRICULUM
from tests.app.window.opened_window import run_script

NAMES = sorted(file.stem for file in CURRICULUM.glob("*.toml"))
FAST = ("uncinectomy",)
"""`tests/app/ladder/test_starts.py` begins all of them, in the window."""

FRAMES = 3


class Short:
    """Ends the flight after its first frames."""

    def __init__(self) -> None:
        self.flight: Flight | None = None
        self.frames = 0

    def hear(self, event: FlightEvent) -> None:
        self.frames += isinstance(event, FrameEvent)
        assert self.flight is not None
        if self.frames == FRAMES:
            self.flight.end()


def coarse(name: str) -> tuple[Scenario, Path]:
    """Return an exercise on a head that is built in seconds."""
    scenario, folder = load_scenario(name)
    head = msgspec.structs.replace(scenario.head, spacing_mm=1.0)
    return msgspec.structs.replace(scenario, head=head), folder


@pytest.mark.parametrize(
    "name", [n if n in FAST else pytest.param(n, marks=pytest.mark.slow) for n in NAMES]
)
def test_an_exercise_begins(name: str, tmp_path: Path) -> None:
    """Prepared, rehearsed on a piece of its head, and its first frames flown."""
    scenario, folder = coarse(name)
    mouse = choose_input(None, None, scenario, None, folder / f"{name}.toml")
    order = FlightOrder(scenario, None, mouse, 48, 1, tmp_path / "flight.paravol")
    observer = Short()
    flight = observer.flight = Flight(order, observer.hear)
    assert flight.run() is not None
    assert observer.frames >= FRAMES


SCRIPT = """
import gc, math, sys, threading, time
from contextlib import contextmanager

import msgspec
import numpy as np

from paravol.environment import prepare_environment
prepare_environment()
from numba.core.dispatcher import Dispatcher

from devices import Pose
from paravol.flight.flight import Flight, FlightOrder
from paravol.flight.flight_events import RecordingBegan
from paravol.flight.flight_loop import FrameEvent
from paravol.inputs import choose_input
from paravol.inputs.flight_input import FlightInput, in_the_patient
from paravol.inputs.pose_sources import EndedError
from scenarios import InstrumentState, Sample, load_scenario, tip_frame
from scenarios.instruments import INSTRUMENTS

EACH_S, LAST_S, STEP_S = 1.2, 6.0, 0.04
NAMES = list(INSTRUMENTS)
UNTIL_S = EACH_S * len(NAMES) + LAST_S
AHEAD = np.array([0.0, 1.0, 0.0])


def compiled():
    gc.collect()
    return {
        f"{d.py_func.__module__}.{d.py_func.__qualname__} {signature}"
        for d in gc.get_objects()
        if isinstance(d, Dispatcher)
        for signature in d.overloads
    }


class Everything(FlightInput):
    # Works with every tool in turn at one place, then puts the lens into tissue.
    name, keys, has_instrument = "everything", {}, True
    registration = in_the_patient()

    def __init__(self):
        self.completer = self
        self.count = 0

    @contextmanager
    def open(self, patient):
        places = patient.landmarks
        self.place = places.get(PLACE, next(iter(places.values()), np.zeros(3)))
        yield self

    def read(self, timeout_s):
        self.count += 1
        time_s = STEP_S * self.count
        if time_s > UNTIL_S:
            raise EndedError
        last_s = time_s - EACH_S * len(NAMES)
        back_mm = 8.0 if last_s < 0.0 else math.sin(3.0 * last_s)
        # several poses for each frame
        early_s = 0.0 if self.count % 6 == 0 else 1.0
        frame = tip_frame(self.place - back_mm * AHEAD, AHEAD)
        return Pose(time_s, time.monotonic() - early_s, frame, 0)

    def complete(self, pose):
        time_s = pose.time_s
        number = min(int(time_s / EACH_S), len(NAMES) - 1)
        within_s = time_s - number * EACH_S
        aside = np.array([math.sin(9.0 * time_s), 2.0 * math.sin(6.0 * time_s), 0.0])
        works = within_s > 0.4
        state = InstrumentState(
            NAMES[number],
            jaw=min(max(within_s - 0.4, 0.0) * 4.0, 1.0),
            is_working=works,
            is_sucking=within_s > 0.8,
            undone=int(time_s / 5.0),
            washed=int(time_s / 7.0),
        )
        scope_deg = (None, 30.0, 45.0, 70.0)[number % 4]
        return Sample(
            time_s,
            pose.device_from_tip,
            5.0 * time_s,
            self.place + aside,
            AHEAD,
            0,
            state,
            is_frozen=3.0 < time_s < 3.3,
            scope_deg=scope_deg,
        )


class Watch:
    known = None
    frames = 0

    def hear(self, event):
        if isinstance(event, RecordingBegan):
            self.known = compiled()
        elif isinstance(event, FrameEvent):
            self.frames += 1
            self.soil = event.frame.lens


PLACE = "uncinate process, right"
way = sys.argv[1]
if way == "scene":
    NAMES = []
scenario, folder = load_scenario("uncinectomy")
head = msgspec.structs.replace(scenario.head, spacing_mm=1.0)
if way == "scene":
    scenario, folder = load_scenario("centring")
    head = scenario.head
scenario = msgspec.structs.replace(scenario, head=head, tools=())
steered = choose_input("mouse", None, scenario, None, None)
chosen = Everything() if way == "everything" else steered
watch = Watch()
order = FlightOrder(scenario, None, chosen, 700, 2, None, follows_window=True)
flight = Flight(order, watch.hear)


def act():
    # what a hand asks for beside the poses
    def wait(frames):
        goal = watch.frames + frames
        while watch.frames < goal and flight.result is None:
            time.sleep(0.02)
    wait(1)
    if chosen is steered:
        for name in NAMES[:6] or [""] * 3:
            if name:
                flight.hand.choose(name)
            chosen.controls.key("W", True, time.monotonic())
            flight.hand.work(True)
            flight.hand.suck(True)
            wait(8)
            flight.hand.work(False)
            flight.hand.swap()
            chosen.controls.drag(60.0, 20.0, False, time.monotonic())
            chosen.controls.wheel(2.0, time.monotonic())
            wait(8)
            flight.hand.swap()
            flight.hand.undo()
            flight.scope.step(1)
            flight.hand.wash()
        flight.end()
    for edge in (384, 512, 640):
        flight.picture.want(edge)
        flight.scope.camera_deg += 20.0
        wait(20)


actor = threading.Thread(target=act, daemon=True)
actor.start()
flown = flight.run()
assert watch.frames > 20
if way == "everything":
    figures = flight.result.score.operation
    assert figures.edits > 20, figures
    assert figures.bled_ml > 0.0, figures
    assert figures.washes > 0, figures
    assert figures.lens_touched_s > 0.5, figures
for line in sorted(compiled() - watch.known):
    print(line)
"""


@pytest.mark.timeout(1200)
@pytest.mark.parametrize(
    "way",
    [
        "mouse",
        *(pytest.param(w, marks=pytest.mark.slow) for w in ("everything", "scene")),
    ],
)
def test_a_flight_that_does_everything_compiles_nothing(way: str) -> None:
    assert run_script(SCRIPT, way, limit_s=1100.0) == ""
