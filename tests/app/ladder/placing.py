"""The simulated person brings each tool to places that the window names."""

import math
import time
from dataclasses import dataclass

from PySide6.QtCore import Qt

from tests.app.ladder.person import LostError, Person

PLACES, LEAST = 5, 3
"""So many named places are wanted, and so many are enough where no more are seen."""

APART = 0.1
"""Places are at least so far apart, in shares of the picture."""

AT = 0.06
"""A ring so near to a place, in shares of the picture, is at it."""

ENOUGH_S = 10.0
"""He gives a place up after so long."""

CHANGES_S = 2.0
"""He waits so long for another tool to be named."""

DEEPER_S = 0.8
"""After so long without a touch he turns the wheel."""


@dataclass(frozen=True)
class Placing:
    """How long a tool took to touch a place; seconds: None where it did not."""

    tool: str
    place: str
    seconds: float | None


def place_tools(person: Person, tools: tuple[str, ...]) -> list[Placing]:
    """Bring each tool to named places; LostError where few are seen."""
    places = _named(person)
    done = []
    for tool in tools:
        _take(person, tool)
        for name, x, y in places:
            took_s = _touch(person, x, y)
            person.say(f"{tool} to {name} at {x:.2f} {y:.2f}: {took_s}")
            done.append(Placing(tool, name, took_s))
    return done


def _named(person: Person) -> list[tuple[str, float, float]]:
    """Ask for names; draw back until enough places are named."""
    chosen: list[tuple[str, float, float]] = []
    for _ in range(8):
        person.hand.key(Qt.Key.Key_E, is_down=True)
        person.wait(0.6)
        names = person.look().names
        person.hand.key(Qt.Key.Key_E, is_down=False)
        chosen = []
        for name, x, y in names:
            is_in = math.hypot(x - 0.5, y - 0.5) < 0.42
            is_apart = all(
                math.hypot(x - other[1], y - other[2]) > APART for other in chosen
            )
            if is_in and is_apart:
                chosen.append((name, x, y))
        if len(chosen) >= PLACES:
            break
        person.go(-1)
    person.say(f"places: {chosen[:PLACES]}")
    if len(chosen) < LEAST:
        raise LostError(f"only {len(chosen)} places have names")
    return chosen[:PLACES]


def _take(person: Person, tool: str) -> None:
    for _ in range(14):
        words = person.look().tool.partition(":")[2].strip().lower()
        if words.startswith(tool):
            person.wait(1.5)
            return
        before, began = person.eyes.sight.tool, time.monotonic()
        person.hand.tap(Qt.Key.Key_T)
        while person.eyes.sight.tool == before and time.monotonic() < began + CHANGES_S:
            person.wait(0.05)
    raise LostError(f"there is no {tool}")


def _touch(person: Person, x: float, y: float) -> float | None:
    """Point at a place until the tool touches it; return how long that took, s."""
    began = deeper = time.monotonic()
    person.hand.glide(person.picture, x, y)
    while time.monotonic() - began < ENOUGH_S:
        person.wait(0.1)
        sight = person.eyes.sight
        is_touching = "(tool)" in sight.touching or bool(sight.bite)
        is_there = sight.tip and math.hypot(sight.tip[0] - x, sight.tip[1] - y) < AT
        if sight.at_s > began + 0.3 and is_there and is_touching:
            return sight.at_s - began
        if time.monotonic() - deeper > DEEPER_S:
            deeper = time.monotonic()
            person.hand.wheel(2)
    return None
