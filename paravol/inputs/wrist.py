"""The wrist that a mouse has not: a tool in its place turns to what is pointed at.

A surgeon turns a tool so that its window faces what it is to take, and jaws so that
they hold most of that and least of what lies beside. Keys turn it on from there.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from anatomy.tissue import Label
from paravol.inputs.tool_hold import SPARES_MM, tool_of_shaft
from renderers.scene import Volume
from scenarios import tip_frame
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments.catalogue import instrument_named
from surgery.solids import in_capsules

Doubles = NDArray[np.float64]

GRADIENT_MM, FACED_MM = 0.5, 3.0
"""A wall's normal is taken from distances so far off; a tool turns to what lies so deep
behind the wall."""

TURNS = 16
"""Turns that are compared."""

NEAR_MM = 12.0
"""A hazard farther from the tip is in reach of no jaw."""

HALF_OPEN, APART_MM = 0.25, 0.8
"""How far jaws are closed that are compared, and how far apart places between them
are."""

POINTED_MM = 1.5
"""What is pointed at lies so deep below its surface, or less."""

OTHERS, LINING, HURTS = 2.0, 0.25, 20.0
"""What jaws hold besides counts for so many times as much as what is pointed at: other
structures, the mucosa that lines them, and what must not be hurt."""

BETTER = 1.1
"""Another turn is taken where it is so many times better."""


class Wrist:
    """Choose how a tool is turned.

    The same tissue, poses and places give the same turns.
    """

    def __init__(
        self,
        distance: Volume,
        labels: Volume | None = None,
        hazards: HazardVolumes | None = None,
    ) -> None:
        """Take signed air distance, mm, read as it is at the time, and what is where.

        labels: of the head; None where nobody knows. hazards: must not be hurt.
        """
        self._distance, self._labels, self._hazards = distance, labels, hazards

    def turn_deg(
        self, name: str, frame: Doubles, place: Doubles, now_deg: float
    ) -> float:
        """Return the roll, degrees, with which a tool holds what is pointed at.

        frame: of its shaft, 4x4. place: ``(3,)`` on a wall. now_deg: how it is turned;
        it stays so where nothing is better.
        """
        tip, way = frame[:3, 3], -frame[:3, 2]
        off = GRADIENT_MM * np.eye(3)
        steps = self._distance.sample(np.concatenate([place + off, place - off]))
        into = steps[:3] - steps[3:]
        into /= max(float(np.linalg.norm(into)), 1e-9)
        if has_jaws(name) and self._labels is not None:
            wanted = self._label(place, into)
            best = self._holding(name, tip, way, wanted, now_deg)
            if best is not None:
                return best
        level = tip_frame(tip, way)
        aside = place + FACED_MM * into - tip
        right, up = float(aside @ level[:3, 0]), float(aside @ level[:3, 1])
        if math.hypot(right, up) < FACED_MM / 2:
            return now_deg
        return math.degrees(math.atan2(right, up))

    def holds_tissue(self, name: str, frame: Doubles) -> bool:
        """Return whether tissue lies between a tool's jaws; frame: of its shaft."""
        tool = tool_of_shaft(name, frame)
        places = _between_jaws(name, 0.0) @ tool[:3, :3].T + tool[:3, 3]
        return bool((self._distance.nearest(places) > 0.0).any())

    def _label(self, place: Doubles, into: Doubles) -> int:
        """Return the label of what is pointed at: what lies below the lining."""
        assert self._labels is not None
        for deep in np.arange(0.3, POINTED_MM + 0.1, 0.4):
            found = int(self._labels.nearest(place + deep * into, 0))
            if found not in _LININGS:
                return found
        return Label.MUCOSA.value

    def _holding(
        self, name: str, tip: Doubles, way: Doubles, wanted: int, now_deg: float
    ) -> float | None:
        """Return the turn with which jaws hold most of a label and least else."""
        assert self._labels is not None
        turns = now_deg + np.arange(TURNS) * 360.0 / TURNS
        held = _between_jaws(name, HALF_OPEN)
        frames = [tool_of_shaft(name, tip_frame(tip, way, turn)) for turn in turns]
        places = np.stack([held @ f[:3, :3].T + f[:3, 3] for f in frames])
        is_tissue = self._distance.nearest(places) > 0.0
        labels = np.where(is_tissue, self._labels.nearest(places, 0), 0)
        is_wanted, is_lining = labels == wanted, np.isin(labels, list(_LININGS))
        is_other = is_tissue & ~is_wanted & ~is_lining
        worth = is_wanted.sum(axis=1) - OTHERS * is_other.sum(axis=1)
        worth = worth - LINING * (is_lining & is_tissue & ~is_wanted).sum(axis=1)
        if self._hazards is not None:
            for hazard in self._hazards.names:
                if self._hazards.distance_mm(hazard, tip[None])[0] < NEAR_MM:
                    gaps = self._hazards.distance_mm(hazard, places)
                    worth -= HURTS * (gaps < SPARES_MM).sum(axis=1)
        best = int(np.argmax(worth))
        if not is_wanted[best].any():
            return None
        is_better = worth[best] > max(BETTER * worth[0], worth[0] + 1.0)
        return float(turns[best] if is_better else now_deg)


_LININGS = frozenset({0, Label.MUCOSA.value})


@lru_cache(maxsize=64)
def has_jaws(name: str) -> bool:
    """Return whether a tool of the catalogue bites; `NO_TOOL` does not."""
    return name != NO_TOOL and instrument_named(name).has_jaws


@lru_cache(maxsize=16)
def _between_jaws(name: str, jaw: float) -> Doubles:
    """Return places of what jaws take, ``(n, 3)`` in the tool's frame.

    jaw: how far they are closed, 0 to 1.
    """
    rows = instrument_named(name).working_volume(np.eye(4), jaw)
    starts, ends, radii = rows[:, 1:4], rows[:, 4:7], rows[:, 7]
    low = np.minimum(starts, ends).min(axis=0) - radii.max()
    high = np.maximum(starts, ends).max(axis=0) + radii.max()
    axes = [
        np.arange(a, b + APART_MM, APART_MM) for a, b in zip(low, high, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside: Doubles = places[in_capsules(rows, places)]
    return inside
