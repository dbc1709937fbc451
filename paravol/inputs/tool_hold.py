"""The tool in hand where walls hold it, and between its tip and its shaft.

A hand that feels no wall moves a tool by its shaft. The frame of a shaft is that of the
tool, moved sideways to where the straight shaft meets the plane of the tip: for a bent
tool that is beside the tip, and a turn swings the tip about the shaft.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Volume
from scenarios import InstrumentState, tip_frame
from scenarios.instrument_state import EMPTY_HAND, NO_TOOL
from scenarios.instruments.contact_shape import (
    CARRIED_MM,
    CHECKED_MM,
    JAW_STEPS,
    contact_table,
    shaft_mm,
)
from surgery.contact import CapsuleHold, balls_along

Doubles = NDArray[np.float64]

TOUCH_MM = 0.15
"""How deep a touch dents a wall: mucosa yields, and a touch is to be seen and counted,
but it is no pressure (`scenarios.scoring.PRESSURE_MM`)."""

SHORT_MM = 1.5
"""A carried tool that is free where it is to go, so near, goes there: at 100 samples a
second only a hand of 150 mm/s is faster."""

BITES_MM = 1.5
"""So far into tissue a tool is pushed while it works. Else it stops at tissue: nobody
hurts anything by carrying."""


class ToolHold:
    """Hold the tool in hand in front of walls.

    state: what the hand holds and does; none holds nothing back. The same poses,
    states and tissue give the same poses, bit by bit, within bounded time.
    """

    def __init__(self, distance: Volume, pivot_mm: Doubles) -> None:
        """Take signed air distance, mm, read as it is at the time; see `CapsuleHold`.

        pivot_mm: ``(3,)`` where the shaft is held.
        """
        self._hold = CapsuleHold(distance, pivot_mm)
        self.state: InstrumentState = EMPTY_HAND

    def __call__(self, start: Doubles, wanted: Doubles) -> Doubles:
        """Return the shaft's frame, 4x4, that it gets to on its way to a wanted one."""
        return self._go(start, wanted, CHECKED_MM)

    def move_to(self, pivot_mm: Doubles) -> None:
        """Hold the shaft from another place on."""
        self._hold.pivot_mm = pivot_mm

    def carried(
        self, start: Doubles, wanted: Doubles, ahead: Doubles, reach_mm: float
    ) -> Doubles:
        """Return likewise that of a tool that goes before the lens.

        ahead: ``(4,)`` a unit direction and minus the lens's place along it. What lies
        beyond reach_mm, where tissue stops the tip, is held by that alone.
        """
        self.move_to(wanted[:3, 3] + CARRIED_MM * wanted[:3, 2])
        balls = self._balls(CARRIED_MM)
        along = wanted[:3, :3].T @ ahead[:3]
        far = balls[:, [2, 3, 0]] @ along + float(wanted[:3, 3] @ ahead[:3]) + ahead[3]
        kept = far + balls[:, 1] <= reach_mm
        balls = np.ascontiguousarray(balls[kept])
        if np.linalg.norm(start[:3, 3] - wanted[:3, 3]) <= SHORT_MM:
            # what was held by the tip alone may begin deeper than anything is let
            there = self._hold.go(wanted, wanted, balls, self._give_mm)
            if there is wanted:
                return wanted
        return self._hold.go(start, wanted, balls, self._give_mm)

    def _go(self, start: Doubles, wanted: Doubles, length_mm: float) -> Doubles:
        return self._hold.go(start, wanted, self._balls(length_mm), self._give_mm)

    @property
    def _give_mm(self) -> float:
        state = self.state
        return TOUCH_MM + (BITES_MM * state.jaw if state.is_working else 0.0)

    def _balls(self, length_mm: float) -> Doubles:
        """Return the balls of what the hand holds, in the shaft's frame."""
        state = self.state
        if state.name == NO_TOOL:
            return np.zeros((0, 5))
        return _tool_balls(state.name, round(state.jaw * JAW_STEPS), length_mm)


@lru_cache(maxsize=256)
def _tool_balls(name: str, jaw_steps: int, length_mm: float) -> Doubles:
    """Return the balls of a tool's capsules in its shaft's frame."""
    table = contact_table(name, jaw_steps / JAW_STEPS, length_mm).copy()
    table[:, :3] -= shaft_mm(name)
    table[:, 3:6] -= shaft_mm(name)
    return balls_along(table)


def tool_of_shaft(name: str, shaft: Doubles) -> Doubles:
    """Return the tool's frame, 4x4, of its shaft's."""
    return _moved(shaft, -1.0 * shaft_mm(name))


def shaft_of_tool(name: str, tool: Doubles) -> Doubles:
    """Return the shaft's frame, 4x4, of the tool's."""
    return _moved(tool, shaft_mm(name))


def roll_deg(frame: Doubles) -> float:
    """Return the roll with which `scenarios.tip_frame` gives this frame's x and y."""
    level = tip_frame(frame[:3, 3], -frame[:3, 2])
    x = frame[:3, 0]
    return math.degrees(math.atan2(-float(x @ level[:3, 1]), float(x @ level[:3, 0])))


def _moved(frame: Doubles, by_mm: Doubles) -> Doubles:
    moved = np.array(frame, dtype=np.float64)
    moved[:3, 3] += frame[:3, :3] @ by_mm
    return moved
