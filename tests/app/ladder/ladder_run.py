"""The window in a process of its own, and a person before it who does an exercise.

    python -m tests.app.ladder.ladder_run EXERCISE... --folder OUT

A case is named by `case:` and the name of its folder, which `--case` gives.

Prints one line of JSON for each exercise: how it began, and how it ended.
"""

import argparse
import json
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TextIO

from paravol.environment import prepare_environment

prepare_environment()

import msgspec  # noqa: E402
from PySide6.QtWidgets import QApplication  # noqa: E402

from app.window.main_window import MainWindow  # noqa: E402
from app.window.navigator import Navigator, NavigatorOrder  # noqa: E402
from paravol.exercises.training_setup import DeviceSetup, TrainingSetup  # noqa: E402
from paravol.flight.flight import FlightOrder  # noqa: E402
from paravol.progress.session_entry import SessionEntry  # noqa: E402
from paravol.progress.store import ProgressStore  # noqa: E402
from paravol.sessions.session_store import SessionStore  # noqa: E402
from paravol.trainee.choices import ChoiceFile, Choices  # noqa: E402
from scenarios import Scenario, load_scenario  # noqa: E402
from scenarios.scenario import CURRICULUM  # noqa: E402
from tests.app.ladder.person import LostError, Person  # noqa: E402
from tests.app.ladder.placing import Placing, place_tools  # noqa: E402
from tests.app.ladder.skills import Trainee, look_round  # noqa: E402

SIZE = 1280, 720
COARSE_MM = 1.0
CASE = "case:"
"""Before the name of a case's folder."""

PICTURE_PX = 256
TRAINEE = "Robin"


@dataclass
class Verdict:
    """How an exercise went.

    began: its first picture was seen. why: it ended before it was done; "" otherwise.
    seconds: of the exercise's own clock. read: the words of the result page. placings:
    of tools, where these were asked for.
    """

    exercise: str
    began: bool = False
    done: bool = False
    passed: bool = False
    tries: int = 0
    seconds: float = 0.0
    wall_s: float = 0.0
    tasks: str = ""
    injuries: list[str] = field(default_factory=list)
    why: str = ""
    read: list[str] = field(default_factory=list)
    placings: list[Placing] = field(default_factory=list)


def unlock(store: Path) -> None:
    """Prepare a trainee who has passed the whole ladder."""
    kept = ProgressStore(store)
    names = sorted(file.stem for file in CURRICULUM.glob("*.toml"))
    for number, name in enumerate(names):
        scenario, _ = load_scenario(name)
        for run in range(3):
            kept.add(
                SessionEntry(
                    TRAINEE,
                    f"{number * 3 + run:064x}",
                    f"{name}-{run}",
                    name,
                    scenario.title,
                    f"2020-01-0{run + 1}T00:00:00+00:00",
                    60.0,
                    is_complete=True,
                    has_passed=True,
                )
            )


class CoarseSetup(TrainingSetup):
    """Train in heads that are built in a few seconds; all else is as it is."""

    def order(
        self, scenario: str, attempts: Callable[[str], int] = lambda name: 0
    ) -> FlightOrder:
        order = super().order(scenario, attempts)
        if order.scenario.head.scene or order.scenario.head.case:
            return order
        head = msgspec.structs.replace(order.scenario.head, spacing_mm=COARSE_MM)
        coarse = msgspec.structs.replace(order.scenario, head=head)
        return replace(order, scenario=coarse)


class Sitting:
    """A window with a person before it, until it is closed."""

    def __init__(
        self,
        folder: Path,
        seed: int,
        log: TextIO | None,
        cases: tuple[str, ...] = (),
        *,
        is_coarse: bool = False,
    ) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        store, choices = folder / "progress.sqlite", folder / "trainee.json"
        if not store.exists():
            unlock(store)
        ChoiceFile(choices).save(
            Choices(trainee=TRAINEE, tours=("home", "flight"), cases=cases)
        )
        setup = (CoarseSetup if is_coarse else TrainingSetup)(
            devices=DeviceSetup(),
            size=PICTURE_PX,
            threads=1,
            sessions=SessionStore(folder / "sessions"),
        )
        self.window = MainWindow()
        self.desk = Navigator(
            self.window, NavigatorOrder(setup, store=store, choices=choices)
        )
        self.window.resize(*SIZE)
        self.window.show()
        self.desk.open_home()
        self.person = Person(self.window, seed, log)
        self._log = log

    def shoot(self, name: str) -> None:
        """Keep a picture of the window."""
        self.window.page.catch_up()
        self.window.grab().save(str(self.folder / f"{name}.png"))

    def do(
        self,
        scenario: Scenario,
        limit_s: float,
        *,
        only_start: bool,
        places_tools: bool = False,
    ) -> Verdict:
        """Start an exercise from the home page, do it, and read its result.

        A case has the name of its folder on the home page. places_tools: what is done
        with tools is not done, but each is brought to named places.
        """
        name, title, person = scenario.name, scenario.title, self.person
        verdict = Verdict(name, tries=1)
        began = time.monotonic()
        try:
            person.start(title)
            person.first_picture(600.0)
            verdict.began = True
            self.shoot(f"{name}-start")
            if only_start:
                self._leave()
                return verdict
            person.until_s = time.monotonic() + limit_s
            try:
                if scenario.tasks:
                    trainee = Trainee(person, lambda at: self.shoot(f"{name}-{at}"))
                    trainee.do_all(but_with_tools=places_tools)
                    if places_tools:
                        verdict.placings = place_tools(person, scenario.tools)
                else:
                    look_round(person)
                verdict.done = True
            except LostError as lost:
                verdict.why = str(lost)
            self.shoot(f"{name}-end")
            verdict.tasks = person.eyes.sight.done
            verdict.seconds = _seconds(person.eyes.sight.gauges.get("Time", ""))
            verdict.read = (
                person.end() if person.eyes.sight.page == "FlightPage" else []
            )
            if not verdict.read:
                verdict.read = person.eyes.texts()
            self.shoot(f"{name}-result")
            verdict.passed = any(
                text.startswith("Passed") or text == "Pass" for text in verdict.read
            )
            verdict.injuries = [t for t in verdict.read if "njur" in t]
            person.go_home()
        except LostError as lost:
            verdict.why = verdict.why or str(lost)
            self.shoot(f"{name}-lost")
            self._go_home()
        verdict.wall_s = time.monotonic() - began
        return verdict

    def _go_home(self) -> None:
        """Leave wherever he is lost, by the page's own button or by keys."""
        from PySide6.QtCore import Qt

        person = self.person
        for key in (Qt.Key.Key_Q, Qt.Key.Key_Return):
            if person.eyes.sight.page == "FlightPage":
                person.hand.tap(key)
                person.wait(1.0)
        try:
            if person.eyes.sight.page != "HomePage":
                person.go_home()
        except LostError as lost:
            print(lost, file=sys.stderr)

    def _leave(self) -> None:
        """Leave a flight, and go home from its result."""
        from PySide6.QtCore import Qt

        person = self.person
        person.hand.tap(Qt.Key.Key_Q)
        person.wait(0.3)
        person.hand.tap(Qt.Key.Key_Return)
        person.wait_for(
            "the result", lambda: person.eyes.sight.page == "ResultPage", 120.0
        )
        person.go_home()

    def close(self) -> None:
        """Close the window, and end what is under way."""
        self.window.shut()
        self.desk.close()
        self.window.release()


def _seconds(clock: str) -> float:
    """Read the clock: "0:12.3", "1:02" or "12.3 s"."""
    words = clock.replace("s", "").strip()
    try:
        total = 0.0
        for part in words.split(":"):
            total = 60.0 * total + float(part)
    except ValueError:
        return 0.0
    return total


def main() -> int:
    """Run what the command line says."""
    parser = argparse.ArgumentParser()
    parser.add_argument("exercises", nargs="+")
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--limit", type=float, default=300.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only-start", action="store_true")
    parser.add_argument("--places-tools", action="store_true")
    parser.add_argument("--coarse", action="store_true")
    parser.add_argument("--tries", type=int, default=1)
    parser.add_argument("--aloud", action="store_true")
    parser.add_argument("--case", type=Path, action="append", default=[])
    told = parser.parse_args()
    application = QApplication(["paravol"])
    cases = tuple(str(folder.resolve()) for folder in told.case)
    failed: list[str] = []

    def hook(*what: object) -> None:
        failed.append(str(what[1]))
        traceback.print_exception(*what)  # type: ignore[call-overload]

    sys.excepthook = hook
    log = sys.stderr if told.aloud else None
    sitting = Sitting(told.folder, told.seed, log, cases, is_coarse=told.coarse)
    for name in told.exercises:
        if name.startswith(CASE):
            scenario = Scenario(name.removeprefix(CASE), name.removeprefix(CASE))
        else:
            scenario = load_scenario(name)[0]
        for tries in range(1, told.tries + 1):
            verdict = sitting.do(
                scenario,
                told.limit,
                only_start=told.only_start,
                places_tools=told.places_tools,
            )
            verdict.tries = tries
            if verdict.passed or told.only_start:
                break
        print(json.dumps(asdict(verdict)), flush=True)
    sitting.close()
    del application
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
