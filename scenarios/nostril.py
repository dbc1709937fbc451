"""How far scope and tool drag on the nostril that they pass through.

A shaft at ease passes through the middle of a nostril, a tool somewhat below the scope.
How far its line is off that place is measured; the force is that way times a stiffness,
which is a guess: nobody has measured the nostril's.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.cross import dot

Doubles = NDArray[np.float64]

STIFFNESS_N_MM = 0.3
"""A guess. Off the middle by 7 mm it gives 2 N; a scope is pressed with 2.2 N on
average (Eur Arch Otorhinolaryngol 2008), its tip included."""

BELOW_MM = 3.0
"""A tool lies so far below the scope where both share a nostril; the phantom's is 9 mm
high and 6 mm wide."""

ABSENT_S = 0.5
"""Longer than this between two samples nobody knows what was dragged on."""

SCOPE, TOOL = "scope", "tool"


@dataclass(frozen=True, slots=True)
class Nostrils:
    """Where shafts pass at ease: ``(n, 3)`` patient mm, a row a nostril."""

    scope_mm: Doubles
    tool_mm: Doubles

    @classmethod
    def of(cls, middles_mm: Doubles, axes: Doubles) -> "Nostrils":
        """Take the nostrils' middles and the ways in, ``(n, 3)`` each."""
        beside = [
            tool_pivot(middle, axis)
            for middle, axis in zip(middles_mm, axes, strict=True)
        ]
        return cls(np.asarray(middles_mm, np.float64), np.array(beside).reshape(-1, 3))


def tool_pivot(pivot_mm: Doubles, axis: Doubles) -> Doubles:
    """Return where a tool passes, ``(3,)``, beside a scope at a pivot.

    axis: ``(3,)`` of the way in.
    """
    way = np.asarray(axis, np.float64)
    way = way / math.sqrt(dot(way, way))
    up = np.array((0.0, 0.0, 1.0)) - way[2] * way
    lower: Doubles = pivot_mm - BELOW_MM * up / math.sqrt(dot(up, up))
    return lower


def drag_mm(places_mm: Doubles, at_mm: Doubles, back: Doubles) -> float | None:
    """Return how far a shaft's line is off the nearest of some places, mm.

    at_mm, back: ``(3,)`` a point of the line, from which the shaft runs along the unit
    vector. None where no place lies beside the shaft: it is not in a nostril.
    """
    least: float | None = None
    for place in places_mm:
        way = place - at_mm
        along = dot(way, back)
        if along <= 0.0:
            continue
        off = math.sqrt(max(dot(way, way) - along * along, 0.0))
        least = off if least is None else min(least, off)
    return least


@dataclass(frozen=True, slots=True)
class NostrilLoad:
    """Sum up how one shaft dragged on the nostril, over the time that it was in it.

    mean_mm, most_mm: off its place. mean_n, most_n: as force, by a guessed stiffness.
    """

    time_s: float
    mean_mm: float
    most_mm: float
    mean_n: float
    most_n: float


@dataclass(slots=True)
class NostrilWatch:
    """Sum the drag of one shaft over samples; each counts until the next."""

    _last: tuple[float, float | None] | None = None
    _time_s: float = 0.0
    _dose: float = 0.0
    _most: float | None = None

    def add(self, time_s: float, drag: float | None) -> None:
        """Take in one sample; drag: mm, None out of the nostril."""
        if self._last is not None:
            last_s, last = self._last
            elapsed_s = time_s - last_s
            if last is not None and elapsed_s <= ABSENT_S:
                self._time_s += elapsed_s
                self._dose += last * elapsed_s
        if drag is not None:
            self._most = drag if self._most is None else max(self._most, drag)
        self._last = time_s, drag

    def load(self) -> NostrilLoad | None:
        """Return the load so far; None where the shaft was in no nostril."""
        if self._most is None:
            return None
        mean = self._dose / self._time_s if self._time_s > 0.0 else self._most
        newtons = STIFFNESS_N_MM * mean, STIFFNESS_N_MM * self._most
        return NostrilLoad(self._time_s, mean, self._most, *newtons)


@dataclass(frozen=True, slots=True)
class ToolContact:
    """Sum up what the tool beside the scope touched without working.

    contacts: separate times. contact_s: in all. worst_depth_mm: of the deepest, and
    worst_structure what it touched then.
    """

    contacts: int = 0
    contact_s: float = 0.0
    worst_depth_mm: float = 0.0
    worst_structure: str = ""


@dataclass(slots=True)
class ToolWatch:
    """Sum contacts of the tool over samples; see `ToolContact`."""

    found: ToolContact = field(default_factory=ToolContact)
    _last: tuple[float, float] | None = None

    def add(self, time_s: float, depth_mm: float, structure: str) -> None:
        """Take in one sample; depth_mm: 0 without contact, or while it works."""
        old, last = self.found, self._last
        was_in = last is not None and last[1] > 0.0
        elapsed_s = 0.0
        if last is not None and was_in and time_s - last[0] <= ABSENT_S:
            elapsed_s = time_s - last[0]
        worst = old.worst_depth_mm, old.worst_structure
        if depth_mm > worst[0]:
            worst = depth_mm, structure
        begun = depth_mm > 0.0 and not was_in
        self.found = ToolContact(
            old.contacts + begun, old.contact_s + elapsed_s, *worst
        )
        self._last = time_s, depth_mm
