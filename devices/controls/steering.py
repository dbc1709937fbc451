"""What hands ask for over time: held keys, deflected sticks, strokes of a mouse."""

import threading
from collections import deque
from dataclasses import dataclass
from enum import IntEnum
from math import isfinite
from typing import Protocol

from devices.controls.fulcrum import Demand
from system import UserError

LONGEST_LOG = 1 << 14
"""Events kept for a reader that is late; a mouse makes a thousand a second."""


SWAP_BUTTON = 1 << 4
"""Not a pedal: it gives the hand to the tool, or back to the scope."""


class Axis(IntEnum):
    """How a scope in a nostril can move; the order is that of `Demand`."""

    INSERT = 0
    YAW = 1
    PITCH = 2
    ROLL = 3


@dataclass(frozen=True, slots=True)
class _Held:
    at_s: float
    axis: Axis
    rate: float


@dataclass(frozen=True, slots=True)
class _Nudged:
    at_s: float
    axis: Axis
    way: float


@dataclass(frozen=True, slots=True)
class _Pressed:
    at_s: float
    button: int
    is_down: bool


class SteeringEvents(Protocol):
    """Take what happens to keys, sticks and a mouse; see `Steering`."""

    def hold(self, axis: Axis, rate: float, at_s: float) -> None:
        """Ask for a share of the rate limit, -1 to 1, from that moment on."""
        ...

    def nudge(self, axis: Axis, way: float, at_s: float) -> None:
        """Ask for some way at once: mm for insertion, degrees for the rest."""
        ...

    def press(self, button: int, is_down: bool, at_s: float) -> None:
        """Press or release the buttons of a bit mask."""
        ...


class Steering:
    """Gather events as they happen; tell what they ask for, step by step.

    Held rates are integrated over their exact times, so that the way travelled does
    not depend on when the steps are asked for. Safe to use from several threads.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._log: deque[_Held | _Nudged | _Pressed] = deque()
        self._rates = [0.0] * 4
        self._levels = 0

    def hold(self, axis: Axis, rate: float, at_s: float) -> None:
        """Ask for a share of the rate limit, -1 to 1, from that moment on."""
        self._add(_Held(at_s, axis, _finite(rate)))

    def nudge(self, axis: Axis, way: float, at_s: float) -> None:
        """Ask for some way at once: mm for insertion, degrees for the rest."""
        self._add(_Nudged(at_s, axis, _finite(way)))

    def press(self, button: int, is_down: bool, at_s: float) -> None:
        """Press or release the buttons of a bit mask; `SWAP_BUTTON` means nothing."""
        self._add(_Pressed(at_s, button & ~SWAP_BUTTON, is_down))

    def step(self, from_s: float, until_s: float) -> tuple[Demand, int]:
        """Return what was asked for in between, and the buttons that were down then.

        Steps must follow one another. An event from before the step counts as if it
        had happened at its start. A button that was down for a part of the step counts
        as down.
        """
        if not until_s > from_s:
            raise UserError(f"a step must take time, got {from_s} to {until_s}")
        ways = [0.0] * 4
        nudges = [0.0] * 4
        since = [from_s] * 4
        with self._lock:
            buttons = self._levels
            while self._log and self._log[0].at_s <= until_s:
                match self._log.popleft():
                    case _Held(at_s, axis, rate):
                        at = max(at_s, since[axis])
                        ways[axis] += self._rates[axis] * (at - since[axis])
                        since[axis] = at
                        self._rates[axis] = rate
                    case _Nudged(_, axis, way):
                        nudges[axis] += way
                    case _Pressed(_, button, is_down):
                        self._press(button, is_down)
                        buttons |= self._levels
            for axis in Axis:
                ways[axis] += self._rates[axis] * (until_s - since[axis])
        taken = until_s - from_s
        return Demand(*(way / taken for way in ways), *nudges), buttons

    def _press(self, button: int, is_down: bool) -> None:
        self._levels = self._levels | button if is_down else self._levels & ~button

    def _add(self, event: _Held | _Nudged | _Pressed) -> None:
        if not isfinite(event.at_s):
            raise UserError(f"an event needs a finite time, got {event.at_s}")
        with self._lock:
            if len(self._log) == LONGEST_LOG:
                self._forget()
            self._log.append(event)

    def _forget(self) -> None:
        """Drop the oldest event, but not the key that it says is down."""
        match self._log.popleft():
            case _Held(_, axis, rate):
                self._rates[axis] = rate
            case _Pressed(_, button, is_down):
                self._press(button, is_down)


def _finite(value: float) -> float:
    if not isfinite(value):
        raise UserError(f"hands ask for finite motions, got {value}")
    return value
