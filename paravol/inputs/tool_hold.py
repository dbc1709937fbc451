"""The tool in hand where walls hold it, and between its tip and its shaft.

A hand that feels no wall moves a tool by its shaft. The frame of a shaft is that of the
tool, moved sideways to where the straight shaft meets the plane of the tip: for a bent
tool that is beside the tip, and a turn swings the tip about the shaft.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from anatomy.wall_layers import WallLayers
from renderers.scene import Volume
from scenarios import InstrumentState, tip_frame
from scenarios.instrument_state import EMPTY_HAND, NO_TOOL
from scenarios.instruments.contact_shape import (
    JAW_STEPS,
    contact_table,
    shaft_mm,
)
from surgery.contact import CapsuleHold, balls_along, between
from surgery.force import Yielding
from surgery.kernels.tool_poses import is_in_middle

Doubles = NDArray[np.float64]

TOUCH_MM = 0.15
"""How deep a touch dents a wall: mucosa yields, and a touch is to be seen and counted,
but it is no pressure (`scenarios.scoring.PRESSURE_MM`)."""

BITES_MM = 1.5
"""So far into tissue a tool is pushed while it works."""


PRESSES_N = 2.5
"""A hand pushes with so much against what holds the tool; each wall yields as deep as
it does to that. A scope is pressed with 2.2 N on average and 8.0 N at most (Eur Arch
Otorhinolaryngol 2008)."""

PUSH_N, YIELDING_MM_S, EASING_MM_S = 3.0, 5.0, 20.0
"""So fast tissue gives way while less is felt, and so fast the hand eases off where it
is free, or where several walls push together."""

BESIDE_MM = 8.0
"""So much of a scope, from its lens, a tool keeps clear of. Farther back both lie in
the vestibule, which yields to both, and one hand gives way to the other."""

DEEPER_MM = 0.3
"""In one step no part gets deeper by more than this."""

YIELDS_MM, SOFTEST_MM = 2.0, 3.0
"""So much a wall yields to a tool that is pushed on, where nobody knows what it is made
of, and the softest one at most: without, no straight shaft gets into a meatus."""

LIP_MM = 8.0
"""So far before the nostril lip and tip of the nose are felt, too."""

SPARES_MM = 0.4
"""So far from what must not be hurt a tool stops."""


class ToolHold:
    """The tool in hand in front of walls.

    state: what the hand holds and does; none holds nothing back. pushed_mm: so deep it
    is pushed into tissue, beyond a touch. The same poses, states and tissue give the
    same poses, bit by bit, within bounded time.
    """

    def __init__(
        self,
        distance: Volume,
        pivot_mm: Doubles,
        hazards: HazardVolumes | None = None,
        layers: WallLayers | None = None,
    ) -> None:
        """Take signed air distance, mm, read as it is at the time; see `CapsuleHold`.

        pivot_mm: ``(3,)`` where the shaft is held. hazards: what no push may reach.
        layers: of the walls; None where all yields alike.
        """
        self._hold = CapsuleHold(distance, pivot_mm)
        self._yields = None if layers is None else Yielding(layers, PRESSES_N)
        self._most_mm = YIELDS_MM if layers is None else SOFTEST_MM
        self._distance, self._hazards = distance, hazards
        self.state: InstrumentState = EMPTY_HAND
        self.pushed_mm = 0.0

    def __call__(self, start: Doubles, wanted: Doubles) -> Doubles:
        """Return the shaft's frame, 4x4, that it gets to on its way to a wanted one."""
        balls = self._inside(self._balls(), start)
        if not len(balls):
            return wanted if np.all(np.isfinite(wanted)) else start
        grown = self._grown(start, balls)
        held = self._hold.go(start, wanted, balls, grown, self._give_mm)
        before, after = (
            self._hazards_mm(self._places(frame, balls)) - balls[:, 1]
            for frame in (start, held)
        )
        # some lie at a wall's face: nothing slides onto them
        is_hurt = (after < SPARES_MM) & (after < before)
        return start if is_hurt.any() else held

    def warm_up(self, frame: Doubles) -> None:
        """Compile what holds a tool that is pushed; frame: in the nose, 4x4."""
        place = frame[:3, 3].copy()
        voxel = np.ascontiguousarray(self._distance.voxel_from_world[:3])
        is_in_middle(self._distance.values, voxel, place)
        if self._yields is not None:
            self._yields.at(place[None])
        self.harm(frame, frame[None])
        self(frame, frame)

    def move_to(self, pivot_mm: Doubles) -> None:
        """Hold the shaft at another place of the nostril, ``(3,)``, from now on."""
        self._hold.pivot_mm = pivot_mm

    def beside(self, scope: Doubles, radius_mm: float) -> None:
        """Let the end of a scope be in the way, too.

        scope: its tip's frame, 4x4.
        """
        ends = scope[:3, 3], scope[:3, 3] + BESIDE_MM * scope[:3, 2]
        self._hold.guard = np.concatenate([*ends, [radius_mm + self._give_mm]])

    def push(
        self, bite_mm: float, felt_n: float, elapsed_s: float, *, is_held: bool
    ) -> None:
        """Let tissue give way to a hand that pushes on, or ease off.

        bite_mm: how deep a tool that works is pushed. is_held: tissue keeps it from
        where it is wanted. felt_n: what the hand felt last.
        """
        most = max(bite_mm, self._most_mm)
        if felt_n > PUSH_N or not (is_held or bite_mm):
            self.pushed_mm = max(self.pushed_mm - EASING_MM_S * elapsed_s, 0.0)
        else:
            pushed = self.pushed_mm + YIELDING_MM_S * elapsed_s
            self.pushed_mm = min(pushed, most)

    def gains_mm(self, start: Doubles, end: Doubles) -> float:
        """Return how much deeper a part of the tool lies in walls at a second pose.

        Only what is deeper than what gives way counts.
        """
        balls = self._inside(self._balls(), start)
        if not len(balls):
            return 0.0
        thick = balls[:, 1] + self._grown(start, balls)
        before, after = (
            self._distance.sample(self._places(frame, balls)) + thick
            for frame in (start, end)
        )
        return float((after - np.maximum(before, self._give_mm)).max())

    def harm(self, start: Doubles, frames: Doubles) -> tuple[Doubles, Doubles]:
        """Return how far poses stay from hazards and how deep they lie in walls, mm.

        frames: ``(n, 4, 4)`` of the shaft. Of the first, ``(n,)``, at most `SPARES_MM`
        counts, and half of the way there as well. Of the second a dent counts that does
        not give way.
        """
        balls = self._inside(self._balls(), start)
        spared, dents = np.full(len(frames), SPARES_MM), np.zeros(len(frames))
        for n, frame in enumerate(frames if len(balls) else ()):
            for share in (0.5, 1.0):
                places = self._places(between(start, frame, share), balls)
                clear = self._hazards_mm(places) - balls[:, 1]
                spared[n] = min(spared[n], float(clear.min()))
                deep = self._distance.sample(places) + balls[:, 1] - self._give_mm
                dents[n] = max(dents[n], float(deep.max()))
        return spared, dents

    def _places(self, frame: Doubles, balls: Doubles) -> Doubles:
        """Return where balls are, ``(n, 3)``, with the shaft's frame there."""
        along = frame[:3, 3] + balls[:, :1] * frame[:3, 2]
        places: Doubles = along + balls[:, 2:] @ frame[:3, :3].T
        return places

    def _hazards_mm(self, places: Doubles) -> Doubles:
        """Return how far the nearest hazard is from places."""
        if self._hazards is None or not self._hazards.names:
            return np.full(len(places), np.inf)
        found: Doubles = self._hazards.nearest.sample(places) * UNIT_MM
        return found

    def _grown(self, start: Doubles, balls: Doubles) -> Doubles:
        """Return how much thicker balls are, ``(n,)``, so that each stays where it may.

        One that lies deeper already goes no deeper, and lets no other go as deep. A
        push gains nothing on hazards.
        """
        places = self._places(start, balls)
        deep = self._distance.sample(places) + balls[:, 1]
        grown: Doubles = -np.maximum(deep - self._give_mm, 0.0)
        if self.pushed_mm > 0.0:
            left = self._hazards_mm(places) - balls[:, 1] - SPARES_MM
            # from the wall on: so deep it lies already, and so far it may go on
            may = np.maximum(deep, 0.0) + left - TOUCH_MM
            if self._yields is not None and not self.state.is_working:
                may = np.minimum(may, self._yields.at(places) - TOUCH_MM)
            # a thin wall that yields is not gone through, nor jumped through
            may = np.minimum(may, np.maximum(deep, 0.0) + DEEPER_MM)
            values = self._distance.values
            voxel = np.ascontiguousarray(self._distance.voxel_from_world[:3])
            for n in np.flatnonzero(deep > balls[:, 1]):
                if is_in_middle(values, voxel, places[n]):
                    may[n] = min(may[n], deep[n] - TOUCH_MM)
            grown += self.pushed_mm - np.clip(may, 0.0, self.pushed_mm)
        return grown

    @property
    def _give_mm(self) -> float:
        return TOUCH_MM + self.pushed_mm

    def _inside(self, balls: Doubles, frame: Doubles) -> Doubles:
        """Return the balls that are past the lip; farther out no passage holds."""
        inside_mm = float((self._hold.pivot_mm - frame[:3, 3]) @ frame[:3, 2])
        return np.ascontiguousarray(balls[balls[:, 0] <= inside_mm + LIP_MM])

    def _balls(self) -> Doubles:
        """Return the balls of what the hand holds, in the shaft's frame."""
        state = self.state
        if state.name == NO_TOOL:
            return np.zeros((0, 5))
        return tool_balls(state.name, round(state.jaw * JAW_STEPS))


@lru_cache(maxsize=256)
def tool_balls(name: str, jaw_steps: int) -> Doubles:
    """Return the balls of a tool's capsules in its shaft's frame."""
    table = contact_table(name, jaw_steps / JAW_STEPS).copy()
    table[:, :3] -= shaft_mm(name)
    table[:, 3:6] -= shaft_mm(name)
    return balls_along(table)


@lru_cache(maxsize=64)
def jaw_balls(name: str) -> Doubles:
    """Return the balls of what moves of a tool, ``(steps, n, 5)``, closed first."""
    each = [tool_balls(name, step) for step in range(JAW_STEPS, -1, -1)]
    rows = min(len(balls) for balls in each)
    made = np.stack([balls[:rows] for balls in each])
    return made[:, (made != made[0]).any(axis=(0, 2))]


def tool_of_shaft(name: str, shaft: Doubles) -> Doubles:
    """Return the tool's frame, 4x4, of its shaft's."""
    tool = np.array(shaft, dtype=np.float64)
    tool[:3, 3] -= shaft[:3, :3] @ shaft_mm(name)
    return tool


def roll_deg(frame: Doubles) -> float:
    """Return the roll with which `scenarios.tip_frame` gives this frame's x and y."""
    level = tip_frame(frame[:3, 3], -frame[:3, 2])
    x = frame[:3, 0]
    return math.degrees(math.atan2(-float(x @ level[:3, 1]), float(x @ level[:3, 0])))
