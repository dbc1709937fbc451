"""Injuries: tools that enter what must not be hurt, found however fast a hand moves.

A tool is a few capsules. Between two samples their ends move straight, and the way is
followed without a gap (see `surgery.kernels.sweep_hazard`), so that the result does
not depend on how often the tool is measured. A tool enters a structure when it reaches
deeper into it than `OPEN_MM`, through the bone of the wall before it: to touch mucosa,
or to dent it, is no injury.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from anatomy.wall_layers import NO_WALL, WallKind, WallLayers
from renderers.scene import Volume
from renderers.scene.thread_pool import ThreadPool
from surgery import solids as solid
from surgery.edit import Edit
from surgery.kernels.sweep_hazard import (
    DEPTH,
    EVENT,
    GAP,
    INSIDE,
    LOW,
    LOW_TRUE,
    NEAREST,
    OPENED,
    PLACE,
    STATE,
    STAY,
    TIME,
    follow,
    reach_of_cut,
    steepest,
)
from surgery.straight_way import STRIKES_MM_S, is_way
from system import UserError

ABSENT_S = 0.5
"""Longer than this between two samples, a tool was away: nobody knows its way."""

NEAR_MM = 10.0
"""Approaches are kept from here on: farther away nobody asks, and to know it of every
hazard would cost a flight 12 ms a sample."""

HOLE_MM = 2.0
"""A wall that was broken is open up to this far around."""

THROUGH_MM = 6.0
"""So far back from where a tool entered the wall before it is looked for."""

THREADS = 2
"""That look through a head's hazards, which holds up the first picture."""

_BACK_MM = 0.2
_MOST_EVENTS = 32


@dataclass(frozen=True, slots=True)
class Injury:
    """Tell of one structure that was entered.

    time_s: of the session, between samples. structure: as a hazard is named. wall: the
    bone before it, "" where there is none. side: "right" or "left". place_mm: ``(3,)``
    LPS. depth_mm: of the whole stay. by: the tool. through_hole: the wall had been
    broken there before.
    """

    time_s: float
    structure: str
    wall: str
    side: str
    place_mm: NDArray[np.float64]
    depth_mm: float
    by: str
    through_hole: bool = False


@dataclass(frozen=True, slots=True)
class Approach:
    """How near anything came to a structure.

    gap_mm: negative inside. place_mm: ``(3,)`` of the tool's surface, LPS.
    """

    gap_mm: float
    time_s: float
    place_mm: NDArray[np.float64]
    by: str


@dataclass(slots=True)
class _Hazard:
    """One structure's distances, and the least gap so far."""

    values: NDArray[np.int16]
    voxel: NDArray[np.float64]
    grid: tuple[float, float, float]
    nearest: Approach | None = None


@dataclass(slots=True)
class _Tool:
    """Where a tool was, and what is known of each hazard's gap then."""

    time_s: float
    capsules: NDArray[np.float64]
    states: dict[str, NDArray[np.float64]]
    open: dict[str, int] = field(default_factory=dict)
    """Of each hazard that it is in, the number of the injury."""

    def copy(self) -> "_Tool":
        states = {name: state.copy() for name, state in self.states.items()}
        return replace(self, states=states, open=dict(self.open))


@dataclass(frozen=True, slots=True)
class InjuryState:
    """Injuries, nearest approaches and where the tools were; see `InjuryWatch`."""

    tools: dict[str, _Tool]
    injuries: tuple[Injury, ...]
    nearest: dict[str, Approach | None]


class InjuryWatch:
    """Watch tools and cuts; keep every injury and each structure's nearest approach."""

    def __init__(
        self,
        hazards: HazardVolumes,
        layers: WallLayers | None,
        pristine: Volume,
        midline_mm: float = 0.0,
        near_mm: float = NEAR_MM,
    ) -> None:
        """Take a head.

        layers: its walls; None where they are unknown: then all tissue counts as what
        lies behind the bone. pristine: signed air distance before any cut, mm,
        negative in air. midline_mm: x that parts right from left, LPS. near_mm:
        nearest approaches are kept from here on.
        """
        self._layers = layers
        self._midline_mm = midline_mm
        self._near_mm = near_mm
        wall = np.zeros(pristine.shape, np.uint8)
        thickness = np.zeros((256, 2), np.float32)
        self._kinds: tuple[WallKind, ...] = ()
        if layers is not None:
            wall, thickness = layers.wall.values, layers.table()
            self._kinds = layers.kinds
        if wall.shape != pristine.shape:
            raise UserError(
                f"walls of shape {wall.shape} do not fit a head of {pristine.shape}"
            )
        self._head = pristine.values, wall, thickness, _rows(pristine)
        # looked through at the same time: millions of voxels each
        found = ThreadPool(THREADS).map(_hazard, list(hazards.volumes.values()))
        self._hazards = dict(zip(hazards.volumes, found, strict=True))
        self._tools: dict[str, _Tool] = {}
        self._injuries: list[Injury] = []
        self._events = np.empty((_MOST_EVENTS, EVENT))
        # compiled, or fetched compiled, before the flight begins
        self._warm_up()

    @property
    def injuries(self) -> tuple[Injury, ...]:
        """Return all injuries in the order in which they were found.

        The depth of one whose tool is still inside may grow.
        """
        return tuple(self._injuries)

    @property
    def approaches(self) -> Mapping[str, Approach]:
        """Return the nearest approach to each structure, within 0.1 mm.

        Those that nothing came near to are left out.
        """
        return {
            name: hazard.nearest
            for name, hazard in self._hazards.items()
            if hazard.nearest is not None
        }

    def move(self, by: str, time_s: float, capsules: solid.Rows) -> tuple[Injury, ...]:
        """Follow a tool to where it is now; returns new injuries.

        capsules: ``(n, 16)`` rows of `surgery.solids`, in the patient, mm: the same
        parts of the tool in the same order each time. None of its samples may be
        earlier than the one before. A pose that is not finite is no pose: the tool
        comes anew after it, as where no hand can have gone straight.
        """
        if not np.isfinite(capsules).all():
            self.leave(by)
            return ()
        rows = _capsules(capsules)
        before = self._tools.get(by)
        elapsed_s = 0.0 if before is None else time_s - before.time_s
        if before is not None and not time_s >= before.time_s:
            raise UserError(
                f"samples must be in order of time: {time_s} after {before.time_s}"
            )
        is_new = (
            before is None
            or before.capsules.shape != rows.shape
            or elapsed_s > ABSENT_S
            or not is_way(
                _least_moved_mm(before.capsules, rows), elapsed_s, STRIKES_MM_S
            )
        )
        if before is None or is_new:
            fresh = np.zeros(STATE)
            fresh[LOW] = fresh[LOW_TRUE] = -np.inf
            before = _Tool(time_s, rows, {n: fresh.copy() for n in self._hazards})
        found: list[Injury] = []
        for name, hazard in self._hazards.items():
            found += self._follow(by, before, time_s, rows, name, hazard)
        found.sort(key=lambda injury: injury.time_s)
        before.time_s, before.capsules = time_s, rows
        self._tools[by] = before
        return tuple(found)

    def checkpoint(self) -> InjuryState:
        """Return all that later samples may change."""
        return InjuryState(
            {by: tool.copy() for by, tool in self._tools.items()},
            tuple(self._injuries),
            {name: hazard.nearest for name, hazard in self._hazards.items()},
        )

    def restore(self, state: InjuryState) -> None:
        """Forget what was found since."""
        self._tools = {by: tool.copy() for by, tool in state.tools.items()}
        self._injuries = list(state.injuries)
        for name, hazard in self._hazards.items():
            hazard.nearest = state.nearest[name]

    def leave(self, by: str) -> None:
        """Hear that a tool is no longer there; where it comes back it comes anew."""
        self._tools.pop(by, None)

    def cut(self, edit: Edit, distance: Volume) -> tuple[Injury, ...]:
        """Look at what a cut laid open; returns new injuries.

        distance: signed air distance after the cut, mm. Bone that the tool had to
        leave protects what is behind it.
        """
        corners = solid.bounds(edit.solids)
        found = []
        for name, hazard in self._hazards.items():
            place = np.empty(3)
            gap = reach_of_cut(
                hazard.values,
                hazard.voxel,
                hazard.grid,
                self._head,
                distance.values,
                edit.solids,
                *corners,
                place,
            )
            if np.isfinite(gap):
                known = hazard.nearest
                if known is None or gap < known.gap_mm:
                    hazard.nearest = Approach(gap, edit.time_s, place, edit.tool)
                found.append(self._injury(edit.time_s, name, place, -gap, edit.tool))
        self._injuries += found
        return tuple(found)

    def _warm_up(self) -> None:
        """Follow a tool that is where nothing is told of it."""
        rows = np.zeros((1, 7))
        for hazard in list(self._hazards.values())[:1]:
            follow(
                hazard.values,
                hazard.voxel,
                hazard.grid,
                self._head,
                rows,
                rows,
                np.full(STATE, -np.inf),
                -np.inf,
                self._events,
            )

    def _follow(
        self,
        by: str,
        tool: _Tool,
        time_s: float,
        rows: NDArray[np.float64],
        name: str,
        hazard: _Hazard,
    ) -> list[Injury]:
        """Follow a tool past one hazard; returns the injuries that begin."""
        known, events = hazard.nearest, self._events
        count = follow(
            hazard.values,
            hazard.voxel,
            hazard.grid,
            self._head,
            tool.capsules,
            rows,
            tool.states[name],
            self._near_mm if known is None else known.gap_mm,
            events,
        )
        elapsed_s = time_s - tool.time_s
        if events[NEAREST, GAP] < math.inf:
            nearest = events[NEAREST]
            hazard.nearest = Approach(
                float(nearest[GAP]),
                tool.time_s + float(nearest[TIME]) * elapsed_s,
                nearest[PLACE : PLACE + 3].copy(),
                by,
            )
        if name in tool.open:
            number = tool.open[name]
            depth = max(self._injuries[number].depth_mm, float(events[STAY, DEPTH]))
            self._injuries[number] = replace(self._injuries[number], depth_mm=depth)
        begun = []
        for event in events[OPENED:count]:
            tool.open[name] = len(self._injuries)
            at_s = tool.time_s + float(event[TIME]) * elapsed_s
            place = event[PLACE : PLACE + 3].copy()
            injury = self._injury(at_s, name, place, float(event[DEPTH]), by)
            self._injuries.append(injury)
            begun.append(injury)
        if name in tool.open and not tool.states[name][INSIDE]:
            del tool.open[name]
        return begun

    def _injury(
        self,
        time_s: float,
        name: str,
        place: NDArray[np.float64],
        depth_mm: float,
        by: str,
    ) -> Injury:
        structure, _, side = name.partition(", ")
        if not side:
            side = "right" if place[0] < self._midline_mm else "left"
        wall = self._wall_before(name, place)
        through = any(
            old.structure == structure
            and old.wall == wall
            and float(np.linalg.norm(old.place_mm - place)) < HOLE_MM
            for old in self._injuries
        )
        return Injury(time_s, structure, wall, side, place, depth_mm, by, through)

    def _wall_before(self, name: str, place: NDArray[np.float64]) -> str:
        """Name the wall between a place in a structure and the air.

        The one that protects the structure, or else the first that has a name.
        """
        if self._layers is None:
            return ""
        pristine, wall, _, voxel = self._head
        matrix, origin = voxel[:, :3], voxel[:, 3]
        top = np.array(wall.shape[::-1]) - 1
        first = ""
        for _ in range(int(THROUGH_MM / _BACK_MM)):
            index = np.clip(np.rint(matrix @ place + origin).astype(int), 0, top)
            i, j, k = index
            row = int(wall[k, j, i])
            if row != NO_WALL and row < len(self._kinds):
                kind = self._kinds[row]
                if kind.behind and name.startswith(kind.behind):
                    return kind.name
                first = first or kind.name
            if pristine[k, j, i] <= 0.0:
                break
            i, j, k = np.clip(index, 1, top - 1)
            slope = np.array(
                (
                    pristine[k, j, i + 1] - pristine[k, j, i - 1],
                    pristine[k, j + 1, i] - pristine[k, j - 1, i],
                    pristine[k + 1, j, i] - pristine[k - 1, j, i],
                ),
                np.float64,
            )
            slope = matrix.T @ slope
            size = float(np.linalg.norm(slope))
            if size == 0.0:
                break
            place = place - _BACK_MM / size * slope
        return first


def _hazard(volume: Volume) -> _Hazard:
    """Return a structure by its distances, with nothing near it yet."""
    slope = steepest(volume.values, volume.spacing_mm, UNIT_MM)
    lowest_mm = UNIT_MM * int(volume.values.min())
    return _Hazard(volume.values, _rows(volume), (UNIT_MM, slope, lowest_mm))


def _rows(volume: Volume) -> NDArray[np.float64]:
    """Return the ``(3, 4)`` transform of mm to voxels."""
    return np.ascontiguousarray(volume.voxel_from_world[:3])


def _least_moved_mm(before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """Return the way of the end that moved least: a turn moves the others."""
    ways = (after - before)[:, :6].reshape(-1, 3)
    return float(np.linalg.norm(ways, axis=1).min())


def _capsules(rows: solid.Rows) -> NDArray[np.float64]:
    """Return ends and radius ``(n, 7)`` of rows that must be capsules."""
    if rows.ndim != 2 or rows.shape[1] != solid.ROW or len(rows) == 0:
        raise UserError(
            f"a tool is one capsule or more, rows of {solid.ROW} numbers; got shape "
            f"{rows.shape}"
        )
    if (rows[:, 0] != solid.CAPSULE).any():
        raise UserError("a tool that is watched is made of capsules only")
    if (rows[:, 7] < 0.0).any():
        raise UserError(f"a capsule needs a radius, got {rows[:, 7].min()} mm")
    return np.ascontiguousarray(rows[:, 1:8])
