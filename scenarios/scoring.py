"""What a flight was worth, from geometry alone; pictures are never read."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from devices.cross import dot
from scenarios.coverage.watch import CoverageFigures
from scenarios.hazard_watch import HazardApproach, HazardGaps, HazardWatch
from scenarios.nostril import (
    SCOPE,
    TOOL,
    NostrilLoad,
    NostrilWatch,
    ToolContact,
    ToolWatch,
)
from scenarios.tasks import TaskState
from system import UserError

CONTACT_MM = 0.0
"""A gap below this is a contact."""

PRESSURE_MM = 0.3
"""A contact deeper than this is pressure. The arm shakes the tip by 0.1 mm rms, so a
scope that only touches stays above it."""

STILL_MM = 0.5
"""The path grows when the tip has moved this far from where it last grew. Whole counts
of an arm shake the tip by 0.1 mm rms: summed at 100 Hz over 25 s that alone would make
a path of 350 mm out of 240."""

ABSENT_S = 0.5
"""Longer than this between two samples, the device was away: nobody saw the way that
the tip went meanwhile, and where it comes back is no part of the path."""


UNKNOWN_GAP_MM = 1000.0
"""More than any gap that is measured. A flight that was frozen throughout has no other,
and its result is written, too: JSON knows no infinity."""


@dataclass(frozen=True, slots=True)
class InjuryFigure:
    """Sum up one injury; see `surgery.injury.Injury`."""

    time_s: float
    structure: str
    wall: str
    side: str
    place_mm: list[float]
    depth_mm: float
    by: str


@dataclass(frozen=True, slots=True)
class BreakFigure:
    """Tell of a wall that gave in to force; wall: "" where it has no name.

    force_n: largest since the sample before. by: the tool, or the scope.
    """

    time_s: float
    wall: str
    force_n: float
    by: str

    def __str__(self) -> str:
        """Return what broke, at which force and by what."""
        return f"{self.wall or 'bone'}, at {self.force_n:.1f} N by the {self.by}"


@dataclass(frozen=True, slots=True)
class OperationFigures:
    """Sum up an operation.

    edits: cuts that took something. removed_mm3: what was taken, by tissue.
    wall_bone_mm3: of that the bone of walls, by their names. pieces_mm3: of that what
    had become loose. bled_ml, sucked_ml: blood. injuries: in order. washes: of
    the lens. lens_touched_s: how long it touched tissue. greatest_n, scope_n: largest
    force of tissue on the tool and on the scope. broken_walls: how often each gave in,
    by name; breaks: each of them, in order, none in older recordings. injected_ml: of
    a vasoconstrictor, into tissue.
    """

    edits: int = 0
    removed_mm3: dict[str, float] = field(default_factory=dict)
    wall_bone_mm3: dict[str, float] = field(default_factory=dict)
    pieces_mm3: float = 0.0
    bled_ml: float = 0.0
    sucked_ml: float = 0.0
    injuries: list[InjuryFigure] = field(default_factory=list)
    washes: int = 0
    lens_touched_s: float = 0.0
    greatest_n: float = 0.0
    scope_n: float = 0.0
    broken_walls: dict[str, int] = field(default_factory=dict)
    injected_ml: float = 0.0
    breaks: list[BreakFigure] = field(default_factory=list)

    @property
    def broken(self) -> int:
        """Return how many walls gave in."""
        return sum(self.broken_walls.values())


@dataclass(frozen=True, slots=True)
class Score:
    """Sum up a session.

    path_length_mm: length of the tip's path, in steps of at least `STILL_MM`, without
        what happened while nothing was measured.
    min_clearance_mm: smallest gap between the scope's shaft and tissue;
        `UNKNOWN_GAP_MM` where nothing was measured.
    contacts: number of separate times the gap fell below zero.
    target_distance_mm: nearest approach of the tip to each target.
    contact_s: total time in contact. pressure_s: part of it deeper than `PRESSURE_MM`.
    worst_depth_mm: of the deepest contact, 0 without any; worst_structure: what was
        touched then, "" without any.
    touched_s: time in contact with each structure touched.
    hazards: nearest approach to each hazard; empty where the head has no hazards, None
        where nobody measured them, as in older recordings.
    operation: what was taken and hurt; None where nobody operated.
    tasks: how each task of the exercise stands; empty where there were none.
    tool: what the tool beside the scope touched without working; None in older
        recordings. nostril: how "scope" and "tool" dragged on the nostril, where they
        were in it; None in older recordings.
    coverage: what mucosa and landmarks were seen; None where nobody watched.
    """

    duration_s: float
    path_length_mm: float
    min_clearance_mm: float
    contacts: int
    target_distance_mm: dict[str, float]
    contact_s: float = 0.0
    pressure_s: float = 0.0
    worst_depth_mm: float = 0.0
    worst_structure: str = ""
    touched_s: dict[str, float] = field(default_factory=dict)
    hazards: dict[str, HazardApproach] | None = None
    operation: OperationFigures | None = None
    tasks: list[TaskState] = field(default_factory=list)
    tool: ToolContact | None = None
    nostril: dict[str, NostrilLoad] | None = None
    coverage: CoverageFigures | None = None


@dataclass(slots=True)
class Scorer:
    """Accumulate a score, sample by sample, in order of time.

    targets: world positions ``(3,)`` in mm by name.
    """

    targets: dict[str, NDArray[np.float64]]
    _first_s: float | None = None
    _last_s: float = 0.0
    _counted_tip: NDArray[np.float64] | None = None
    _length: float = 0.0
    _gap: float = UNKNOWN_GAP_MM
    _contacts: int = 0
    _depth: float = 0.0
    _structure: str = ""
    _contact_s: float = 0.0
    _pressure_s: float = 0.0
    _worst: tuple[float, str] = (0.0, "")
    _touched: dict[str, float] = field(default_factory=dict)
    _nearest: dict[str, float] = field(default_factory=dict)
    _hazards: HazardWatch = field(default_factory=HazardWatch)
    _tool: ToolWatch = field(default_factory=ToolWatch)
    _nostril: dict[str, NostrilWatch] = field(default_factory=dict)

    def add(
        self,
        time_s: float,
        tip_mm: NDArray[np.float64],
        gap_mm: float,
        structure: str = "",
        hazards: HazardGaps | None = None,
    ) -> None:
        """Take in one sample; times must not run backwards.

        structure: what the scope touches, where the gap is a contact. hazards: how
        near the tools are to them; None where they are unknown.
        """
        if self._first_s is None:
            self._first_s = time_s
        elif time_s < self._last_s:
            raise UserError(
                f"samples must be in order of time: {time_s} after {self._last_s}"
            )
        elapsed_s = time_s - self._last_s
        if self._counted_tip is None or elapsed_s > ABSENT_S:
            self._counted_tip = tip_mm
        else:
            self._last_contact(elapsed_s)
        self._last_s = time_s
        moved = _length(tip_mm - self._counted_tip)
        if moved >= STILL_MM:
            self._length += moved
            self._counted_tip = tip_mm
        self._gap = min(self._gap, gap_mm)
        if hazards is not None:
            self._hazards.add(time_s, hazards)
        depth = max(CONTACT_MM - gap_mm, 0.0)
        self._contacts += depth > 0.0 and self._depth == 0.0
        self._depth, self._structure = depth, structure
        if depth > self._worst[0]:
            self._worst = depth, structure
        if depth > 0.0:
            self._touched.setdefault(structure, 0.0)
        for name, position in self.targets.items():
            distance = _length(tip_mm - position)
            self._nearest[name] = min(self._nearest.get(name, distance), distance)

    def add_hands(
        self,
        time_s: float,
        tool_depth_mm: float,
        structure: str,
        drags_mm: Mapping[str, float],
    ) -> None:
        """Take in what the same sample says of the tool and of the nostril.

        tool_depth_mm: of the tool's contact, 0 for none; structure: what it touches.
        drags_mm: how far the shafts that are in a nostril are off their places.
        """
        self._tool.add(time_s, tool_depth_mm, structure)
        for name in (SCOPE, TOOL):
            watch = self._nostril.setdefault(name, NostrilWatch())
            watch.add(time_s, drags_mm.get(name))

    def copy(self) -> "Scorer":
        """Return a scorer that knows the same samples and goes on by itself."""
        return replace(
            self,
            _touched=dict(self._touched),
            _nearest=dict(self._nearest),
            _hazards=self._hazards.copy(),
            _tool=replace(self._tool),
            _nostril={name: replace(w) for name, w in self._nostril.items()},
        )

    def score(self) -> Score:
        """Return the score so far."""
        first = self._last_s if self._first_s is None else self._first_s
        return Score(
            duration_s=self._last_s - first,
            path_length_mm=self._length,
            min_clearance_mm=self._gap,
            contacts=self._contacts,
            target_distance_mm=dict(self._nearest),
            contact_s=self._contact_s,
            pressure_s=self._pressure_s,
            worst_depth_mm=self._worst[0],
            worst_structure=self._worst[1],
            touched_s=dict(self._touched),
            hazards=self._hazards.approaches(),
            tool=self._tool.found,
            nostril=self._loads(),
        )

    def _loads(self) -> dict[str, NostrilLoad]:
        """Return how each shaft that was in a nostril dragged on it."""
        loads = {name: watch.load() for name, watch in self._nostril.items()}
        return {name: load for name, load in loads.items() if load is not None}

    def _last_contact(self, elapsed_s: float) -> None:
        """Let the contact of the sample before last until the new one."""
        if self._depth == 0.0:
            return
        self._contact_s += elapsed_s
        self._pressure_s += elapsed_s if self._depth > PRESSURE_MM else 0.0
        self._touched[self._structure] += elapsed_s


def _length(vector: NDArray[np.float64]) -> float:
    """Return a length, with the same bits on any processor."""
    return math.sqrt(dot(vector, vector))
