"""The simulated person brings each tool to places that the window names."""

import math
import time
from dataclasses import dataclass

from PySide6.QtCore import Qt

from tests.app.ladder.person import LostError, Person

PLACES = 5
SPOTS = tuple(
    (0.5 + away * math.cos(turn), 0.5 + away * math.sin(turn))
    for away, count in ((0.0, 1), (0.14, 6), (0.27, 10))
    for turn in (2.0 * math.pi * n / count for n in range(count))
)
"""Where in the picture he asks for names, in shares."""

APART = 0.1
"""Places of one name are at least so far apart, in shares of the picture."""

ENOUGH_S = 10.0
"""He gives a place up after so long."""

DEEPER_S = 0.8
"""After so long without a touch he turns the wheel."""


@dataclass(frozen=True)
class Placing:
    """Say how long a tool took to touch a place; seconds: None where it did not."""

    tool: str
    place: str
    seconds: float | None


def place_tools(person: Person, tools: tuple[str, ...]) -> list[Placing]:
    """Bring each tool to five named places; LostError where fewer are seen."""
    places = _named(person)
    done = []
    for tool in tools:
        _take(person, tool)
        for name, x, y in places:
            took_s = _touch(person, name, x, y)
            person.say(f"{tool} to {name} at {x:.2f} {y:.2f}: {took_s}")
            done.append(Placing(tool, name, took_s))
    return done


def _named(person: Person) -> list[tuple[str, float, float]]:
    """Ask for names all over the picture; return five places, of many names."""
    found: list[tuple[str, float, float]] = []
    person.hand.point(person.picture, *SPOTS[0])
    person.hand.key(Qt.Key.Key_E, is_down=True)
    for x, y in SPOTS:
        person.hand.glide(person.picture, x, y)
        person.wait(0.3)
        names = person.look().names
        near = [n for n in names if math.hypot(n[1] - x, n[2] - y) < 0.03]
        found += near[:1]
    person.hand.key(Qt.Key.Key_E, is_down=False)
    chosen: list[tuple[str, float, float]] = []
    for again in (False, True):
        for name, x, y in found:
            is_new = all(name != other[0] for other in chosen)
            is_apart = all(
                math.hypot(x - other[1], y - other[2]) > APART for other in chosen
            )
            if len(chosen) < PLACES and is_apart and (is_new or again):
                chosen.append((name, x, y))
    person.say(f"places: {chosen}")
    if len(chosen) < PLACES:
        raise LostError(f"only {len(chosen)} places have names")
    return chosen


def _take(person: Person, tool: str) -> None:
    for _ in range(14):
        words = person.look().tool.partition(":")[2].strip().lower()
        if words.startswith(tool):
            person.wait(1.5)
            return
        person.hand.tap(Qt.Key.Key_T)
        person.wait(0.15)
    raise LostError(f"there is no {tool}")


def _touch(person: Person, name: str, x: float, y: float) -> float | None:
    """Point at a place until the tool touches it; return how long that took, s."""
    began = deeper = time.monotonic()
    person.hand.glide(person.picture, x, y)
    while time.monotonic() - began < ENOUGH_S:
        person.wait(0.1)
        sight = person.eyes.sight
        if sight.at_s > began + 0.3 and sight.touching == f"{name} (tool)":
            return sight.at_s - began
        if time.monotonic() - deeper > DEEPER_S:
            deeper = time.monotonic()
            person.hand.wheel(2)
    return None
