"""The part of an instrument that takes tissue: where it is and what it does."""

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from surgery import solids
from surgery.edit import Taker
from surgery.solids import BLADE, BOX, CAPSULE, ROUGH, SEED, Rows

TORN_MM = 0.15
"""Amplitude of the roughness that a bite leaves."""


class Action(Enum):
    """Say when an instrument takes tissue.

    BITE: once when its jaws close. SWEEP: all along its way while it works, as a
    debrider, a curette or a knife does. NONE: never.
    """

    NONE = "none"
    BITE = "bite"
    SWEEP = "sweep"


@dataclass(frozen=True, slots=True)
class WorkingPart:
    """Describe what takes tissue, in the tool's frame: mm, +z back up the shaft.

    action: when. taker: what it can take. jaws: rows of `surgery.solids` that a bite
    takes. edge: ``(1, 3)`` a point or ``(2, 3)`` the ends of an edge that is swept, of
    `radius_mm`. needs_suction: works only while suction is on. rough_mm: amplitude of
    the roughness left.
    """

    action: Action = Action.NONE
    taker: Taker = field(default_factory=Taker)
    jaws: Rows = field(default_factory=lambda: np.zeros((0, solids.ROW)))
    edge: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    radius_mm: float = 0.0
    needs_suction: bool = False
    rough_mm: float = TORN_MM

    def bite(self, world_from_tool: NDArray[np.float64], seed: int) -> Rows:
        """Return what closing jaws take, world mm. seed: of the torn surface."""
        rows = moved(self.jaws, world_from_tool)
        rows[:, ROUGH], rows[:, SEED] = self.rough_mm, seed
        return rows

    def sweep(
        self, before: NDArray[np.float64], after: NDArray[np.float64], seed: int
    ) -> Rows:
        """Return what is taken on the way between two poses of the tool, 4x4.

        The way is straight. Parts of it together take what the whole takes.
        """
        first, last = (
            self.edge @ frame[:3, :3].T + frame[:3, 3] for frame in (before, after)
        )
        if len(self.edge) == 1:
            return solids.capsule(
                first[0], last[0], self.radius_mm, rough_mm=self.rough_mm, seed=seed
            )
        return solids.blade(
            first, last, self.radius_mm, rough_mm=self.rough_mm, seed=seed
        )


def moved(rows: Rows, world_from_tool: NDArray[np.float64]) -> Rows:
    """Return solids of the tool's frame in the world; the transform must be rigid."""
    turn, shift = world_from_tool[:3, :3], world_from_tool[:3, 3]
    result = rows.copy()
    for row in result:
        if row[0] == BOX:
            row[1:4] = turn @ row[1:4] + shift
            row[4:7], row[7:10] = turn @ row[4:7], turn @ row[7:10]
            continue
        points = {CAPSULE: 2, BLADE: 4}[float(row[0])]
        place = row[1 : 1 + 3 * points].reshape(points, 3)
        row[1 : 1 + 3 * points] = (place @ turn.T + shift).ravel()
    return result
