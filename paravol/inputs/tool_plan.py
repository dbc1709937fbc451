"""Where a surgeon lays a tool that is to work at a place: through the nostril, past the
walls and the scope, turned so that it holds what is wanted and little else.

Lines through the nostril and turns about them are looked at together, with the shape
that the tool has: a bent tool's shaft passes beside its tip, and jaws that are turned
otherwise need another way in.
"""

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from anatomy.tissue import Label
from anatomy.wall_layers import WallLayers
from devices.controls.fulcrum import Fulcrum
from paravol.inputs.asked_tissue import ASKED, LATER, SPARED
from paravol.inputs.nostril_lines import ROUND, NostrilLines
from paravol.inputs.picture_ray import reach_mm
from paravol.inputs.tool_hold import (
    BESIDE_MM,
    LIP_MM,
    PRESSES_N,
    SOFTEST_MM,
    TOUCH_MM,
    YIELDS_MM,
    jaw_balls,
    tool_balls,
)
from renderers.scene import Volume
from scenarios.endoscope import ANTERIOR, PARALLEL, SUPERIOR
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments.catalogue import Action, instrument_named
from scenarios.instruments.contact_shape import (
    JAW_STEPS,
    shaft_mm,
    works_at_mm,
)
from surgery.force import Yielding
from surgery.kernels import tool_poses as kernel
from surgery.solids import in_capsules

Doubles = NDArray[np.float64]

ENTRY_MM, RINGS = 5.0, 2
"""How far a shaft may be off the nostril's middle, and the rings of places that are
tried. The phantom's nostril is 9 mm high and 6 mm wide, and soft."""

TURNS = 16
"""Turns about a line that are compared."""

BACKS_MM = np.concatenate([np.arange(40.0, 10.0, -2.0), np.arange(10.0, -0.1, -1.0)])
"""Places on a line that are looked at, back from where it was meant to end: so near to
one another that no head of a turbinate lies between them."""

BITES_MM = np.array([2.0, 1.0, 0.0, -1.5, -3.0, -4.5])
"""The same for open jaws, which go on about what they bite."""

OPENINGS = 16, 12, 9
"""Steps by which jaws are opened for that."""

JAWS_MM = 6.0
"""So much of a tool's end may lie in tissue while it bites."""

END_MM = 15.0
"""Length of a tool's end: jaws and bends lie there."""

SHUT_STEPS = 14
"""Of `JAW_STEPS`: jaws that go somewhere are closed so far; farther they would bite."""

FREE_MM = 0.8
"""No deeper it presses while it is turned."""

ASIDE_MM = 4.0
"""So far beside its place a tip may go, where the scope leaves no other way."""

TOUCHES = 11
"""Places of the last millimetre before a wall that are looked at."""

WAITS_MM = 6.0
"""Jaws wait no farther than this before what they are to bite."""

SKIN_MM, REACHED = 2.5, 8.0
"""Tissue so deep below what an eye sees is that; and what a tool without jaws is worth
in its place, less by 1 for each mm that it stops before it."""

ABOUT_MM, BETTER = 1.5, 1.3
"""So far about the place that is pointed at bites are looked for, too; one is taken
that is so many times better."""

NEAR_MM = 5.0
"""A tool that stops farther from its place than this has not come there."""

NEAR_ASKED_MM = 2.0
"""Who points so near to what is asked for means that."""

GRADIENT_MM, POINTED_MM = 0.5, 1.5
"""A wall's normal is taken from distances so far off; what is pointed at lies so deep
below its surface, or less."""

CLEARS_MM, LEANS_MM = 0.7, 0.4
"""Nearer to what must not be hurt nothing is bitten, half a diagonal between places,
and no shaft leans on it."""

RIM_MM = 0.4
"""So far before the surface of other tissue a bite may take of it: half a voxel's, and
half the way between places."""

ROUGH_MM = 0.3
"""So much farther jaws tear."""

PRESSED_MM = 0.0, 0.75, 1.5
"""So far a window is pressed on into tissue; pressed by nothing it takes what bulges
into it."""

APART_MM = 0.8
"""Between places that are looked at between jaws."""

OTHERS, SPARES, BESIDE, LINED, HURTS = 2.0, 20.0, 1.0, 0.25, 1e4
"""What jaws hold besides counts for so many times as much as what is pointed at: other
structures; where an exercise asks for tissue, what it spares, and the rest; the mucosa
that lines all. What must not be hurt outweighs all that jaws can hold."""

DEEP, OFF, EVEN, ABOVE = 6.0, 0.5, 0.05, 0.6
"""What a pose loses for each mm that it dents walls, that it ends off its place, and
that it passes off the nostril's middle; and for a way in above the lens, where it hides
what is seen."""

VAIN, VAIN_MM = 12.0, 1.5
"""What it loses where it was tried in vain, and how near to that."""

WAYS, ROUGHLY = 8, 5
"""Of the ways to a place that many are told, at most; for those, of places between jaws
one of so many is looked at."""

TURNED, MOVED, STAYS = 4.0, 0.3, 6.0
"""What it loses by half a turn, and by each mm that the nostril's place moves; and by
any change: a hand trembles, and turns no tool for that."""


class Pose(NamedTuple):
    """A shaft's way in: through entry_mm, ``(3,)``, to end_mm, ``(3,)``.

    off_mm: how far before its place it ends. For a bite it goes on by bite_mm with its
    jaws open: jaw, 0 to 1, is how far they are closed, and 1 where there is nothing to
    bite. What shaves is pressed on by bite_mm, towards its y. worth: see
    `ToolPlan.worth`.
    """

    entry_mm: Doubles
    end_mm: Doubles
    roll_deg: float
    off_mm: float
    jaw: float = 1.0
    bite_mm: float = 0.0
    worth: float = 0.0


class _Look(NamedTuple):
    """What a pose is looked for with; see `ToolPlan.choose`.

    wanted: the label of what is bitten, None for nothing. stride: of the places between
    jaws one of so many is looked at. stays: what any other way loses than the present.
    touches: it is brought to tissue.
    """

    name: str
    guard: Doubles
    up: Doubles
    now: tuple[Doubles, float]
    vain: Sequence[Pose]
    wanted: int | None
    stride: int = 1
    stays: float = 0.0
    touches: bool = True


class _Bites(NamedTuple):
    """Bites that jaws opened by so many steps may take, ``(n,)`` each.

    of: numbers of the lines. waits_mm, at_mm: how far before the lines' ends jaws wait,
    and bite. held, total: what they hold, less what they should not, and all in all.
    """

    of: NDArray[np.int64]
    waits_mm: Doubles
    at_mm: Doubles
    steps: int
    held: Doubles
    total: Doubles


class ToolPlan:
    """Choose how a tool lies in the nose.

    The same tissue, places and scope give the same poses.
    """

    def __init__(
        self,
        fulcrum: Fulcrum,
        distance: Volume,
        labels: Volume | None = None,
        hazards: HazardVolumes | None = None,
        layers: WallLayers | None = None,
    ) -> None:
        """Take the nostril, and signed air distance, mm, read as it is at the time.

        labels: what is where in the head; None where nobody knows. hazards: must not
        be hurt. layers: of the walls, on the distance's voxels; None where all yields.
        """
        self._distance = distance
        if labels is None:
            labels = distance.with_values(np.ones(distance.shape, np.uint8), 0)
        self._labels = labels
        self._lines = NostrilLines(fulcrum, distance, ENTRY_MM, RINGS)
        none = Volume(np.zeros((2, 2, 2), np.int16), np.ones(3), np.full(3, 1e6))
        known = hazards is not None and bool(hazards.names)
        self._hazards = hazards.nearest if hazards is not None and known else none
        nowhere = np.zeros((1, 1, 1), np.uint8)
        self._yields = nowhere, nowhere, np.full((1, 1), YIELDS_MM)
        self._most_mm = YIELDS_MM if layers is None else SOFTEST_MM
        if layers is not None:
            walls = Yielding(layers, PRESSES_N)
            self._yields = walls.walls, walls.grounds, walls.dents_mm

    def choose(
        self,
        name: str,
        place: Doubles,
        scope: Doubles,
        radius_mm: float,
        up: Doubles,
        now: tuple[Doubles, float],
        vain: Sequence[Pose] = (),
        *,
        is_at_tissue: bool,
        beside: bool = True,
    ) -> Pose:
        """Return the pose of a tool that is to work at a place, ``(3,)``.

        scope, radius_mm: its tip's frame, 4x4, and its shaft; up: of the picture. now:
        entry and turn as they are: they stay where nothing is much better.
        vain: poses that it did not get to. is_at_tissue: it is brought to tissue, and
        turned for it. beside: where it does not get there, it may go beside its place.
        """
        wanted = self._label(place) if is_at_tissue and _takes(name) else None
        guard = _guard(scope, radius_mm)
        stays = STAYS if beside else 0.0
        look = _Look(
            name, guard, up, now, vain, wanted, stays=stays, touches=is_at_tissue
        )
        found = self._best(look, place)
        if beside and wanted is not None:
            # who points beside a good bite of the same means that
            right = np.cross(up, scope[:3, 2])
            for aside in (right, -right, up, -up):
                other = self._best(look, place + ABOUT_MM * aside)
                if other.worth > BETTER * found.worth + 1.0:
                    found = other
        if beside and found.off_mm > NEAR_MM and not found.worth:
            # where the scope lies in the way a tool works beside it
            for aside in self._lines.off[-ROUND::2] * (ASIDE_MM / ENTRY_MM):
                other = self._best(look, place + aside)
                if other.off_mm < found.off_mm - ASIDE_MM / 2.0:
                    found = other
        return found

    def warm_up(self, name: str, frame: Doubles) -> None:
        """Compile what looks at poses; `frame`: any of them, 4x4."""
        guard, now = _guard(frame, 1.0), (frame[:3, 3], 0.0)
        look = _Look(name, guard, frame[:3, 1], now, (), Label.MUCOSA.value)
        self._depths(name, frame[None], BACKS_MM, guard)
        self._held(look, frame[None], OPENINGS[0], Label.MUCOSA.value)

    def worth(
        self,
        name: str,
        places: Doubles,
        scope: Doubles,
        radius_mm: float,
        up: Doubles,
        eye: Doubles,
    ) -> Doubles:
        """Return what a tool is worth at tissue at places ``(n, 3)`` that an eye sees.

        That is what its jaws would hold of it, less of the rest; of a tool without
        jaws how near it comes. 0 where it can do nothing, and where who points at what
        is asked for points at something else before it.
        """
        now = self._lines.middle_mm, 0.0
        found = np.zeros(len(places))
        is_asked = self._labels.nearest(places, 0) == ASKED
        is_asked &= _takes(name)
        for number, place in enumerate(places):
            way = place - eye
            ray = way / np.linalg.norm(way)
            seen_mm = reach_mm(self._distance, eye, ray)
            if abs(seen_mm - float(np.linalg.norm(way))) < SKIN_MM:
                if is_asked[number] and self._label(eye + seen_mm * ray) != ASKED:
                    continue
                pose = self.choose(
                    name,
                    eye + seen_mm * ray,
                    scope,
                    radius_mm,
                    up,
                    now,
                    is_at_tissue=True,
                    beside=False,
                )
                found[number] = pose.worth
        return found

    def is_free(
        self, name: str, scope: Doubles, radius_mm: float, frames: Doubles
    ) -> bool:
        """Return whether a tool may be at each of some poses, ``(n, 4, 4)``."""
        guard = _guard(scope, radius_mm)
        found = self._depths(name, frames, np.zeros(1), guard, FREE_MM)
        return bool(np.isfinite(found).all())

    def _poses(
        self, name: str, place: Doubles, now: tuple[Doubles, float]
    ) -> list[Doubles]:
        """Return frames ``(n, 4, 4)`` of shafts to a place, entries and turns."""
        count = TURNS if _is_turned(name) else 1
        turns = now[1] + np.arange(count) * (360.0 / count)
        entries = np.vstack([now[0], self._lines.places_mm])
        entries = np.repeat(entries, count, axis=0)
        rolls = np.tile(turns, len(entries) // count)
        off = shaft_mm(name) - works_at_mm(name)
        ends = np.broadcast_to(place, entries.shape)
        for _ in range(2):
            # a bent tool's shaft passes beside its tip
            frames = tip_frames(ends, ends - entries, rolls)
            ends = place + frames[:, :3, :3] @ off
        frames = tip_frames(ends, ends - entries, rolls)
        return [frames, entries, rolls]

    def _depths(
        self,
        name: str,
        frames: Doubles,
        backs_mm: Doubles,
        guard: Doubles,
        most_mm: float = math.inf,
        free_mm: float = -math.inf,
    ) -> Doubles:
        """Return how deep a closed tool lies in walls, ``(n, m)``; see `depths`."""
        origins = np.ascontiguousarray(frames[:, :3, 3])
        inside = ((self._lines.middle_mm - origins) * frames[:, :3, 2]).sum(axis=1)
        inside += LIP_MM
        found = np.empty((len(frames), len(backs_mm)))
        kernel.depths(
            kernel.Around(
                self._distance.values,
                np.ascontiguousarray(self._distance.voxel_from_world[:3]),
                *self._yields,
                guard,
                self._hazards.values,
                np.ascontiguousarray(self._hazards.voxel_from_world[:3]),
                UNIT_MM,
                LEANS_MM,
            ),
            origins,
            np.ascontiguousarray(frames[:, :3, :3]),
            inside,
            backs_mm,
            tool_balls(name, SHUT_STEPS),
            END_MM,
            free_mm,
            min(most_mm, self._most_mm),
            found,
        )
        return found

    def _best(self, look: "_Look", place: Doubles) -> Pose:
        """Return the best pose to a place."""
        name = look.name
        poses = self._poses(name, place, look.now)
        deep, worth = self._ways(look, poses)
        n, m = divmod(int(np.argmax(worth)), len(BACKS_MM))
        if not np.isfinite(worth[n, m]):
            # nothing gets in: it waits outside
            return Pose(self._lines.middle_mm, place, look.now[1], math.inf)
        back_mm = self._touching(look, poses[0][n : n + 1], m)
        near = 0.0 if look.wanted is not None else max(REACHED - back_mm, 0.0)
        found = _pose(poses, n, back_mm, worth=near)
        best = -math.inf
        for bites in self._bites(look, poses, deep):
            first = int(np.argmax(bites.total))
            if bites.total[first] > best:
                best = float(bites.total[first])
                back = float(bites.waits_mm[first])
                held = float(bites.held[first])
                jaw = 1.0 - bites.steps / JAW_STEPS
                ahead_mm = back - float(bites.at_mm[first])
                if shaves(name):
                    back, jaw = float(bites.at_mm[first]), 1.0
                    ahead_mm = PRESSED_MM[bites.steps]
                found = _pose(poses, bites.of[first], back, jaw, ahead_mm, held)
        return found

    def _touching(self, look: "_Look", frame: Doubles, m: int) -> float:
        """Return how far before its place a tool on a line meets the first wall.

        Places are looked at a millimetre apart: between that which is free and the next
        one a tool that is brought to tissue would stop short of it.
        """
        back_mm = float(BACKS_MM[m])
        ahead_mm = 1.0 if look.touches else min(back_mm, 1.0)
        fine = back_mm - np.linspace(0.0, ahead_mm, TOUCHES)
        deep = self._depths(look.name, frame, fine, look.guard)[0]
        if deep[0] > 0.0:
            return back_mm
        return float(fine[np.flatnonzero(deep <= TOUCH_MM)[-1]])

    def lines(
        self, name: str, places: Doubles
    ) -> tuple[NDArray[np.int64], Doubles, Doubles, Doubles]:
        """Return ways in to tissue at places ``(n, 3)``, the scope away, the best ones.

        That is the number of the place of each, its shaft's ends in the nostril and at
        the place, ``(m, 3)``, and what the tool is worth there.
        """
        of, found = [], []
        away = np.full(7, -1.0)
        for number, inside in enumerate(places):
            deep_mm = float(self._distance.sample(inside[None])[0])
            place = inside - deep_mm * self._normal(inside)
            wanted = self._label(place) if _takes(name) else None
            now = self._lines.middle_mm, 0.0
            look = _Look(name, away, SUPERIOR, now, (), wanted, ROUGHLY)
            poses = self._poses(name, place, now)
            deep, worth = self._ways(look, poses)
            held = np.zeros(len(poses[0]))
            if wanted is None:
                far = np.where(np.isfinite(worth).any(axis=1), worth.argmax(axis=1), 0)
                near = np.maximum(REACHED - BACKS_MM[far], 0.0)
                held = np.where(np.isfinite(worth).any(axis=1), near, 0.0)
            for bites in self._bites(look, poses, deep):
                np.maximum.at(held, bites.of, bites.held)
            best = np.argsort(-held)[:WAYS]
            best = best[held[best] > 0.0]
            of += [number] * len(best)
            ends = poses[0][best, :3, 3]
            found.append(np.column_stack([poses[1][best], ends, held[best]]))
        rows = np.vstack([np.zeros((0, 7)), *found])
        return np.array(of, np.int64), rows[:, :3], rows[:, 3:6], rows[:, 6]

    def _ways(self, look: "_Look", poses: Sequence[Doubles]) -> tuple[Doubles, Doubles]:
        """Return how deep a tool lies in walls on its ways in, and their worth."""
        deep = self._depths(look.name, poses[0], BACKS_MM, look.guard)
        # what is narrow on the way is so for what lies behind
        deep = np.maximum.accumulate(deep, axis=1)
        return deep, self._loss(look, deep, BACKS_MM, poses)

    def _bites(
        self, look: "_Look", poses: Sequence[Doubles], deep: Doubles
    ) -> Iterator["_Bites"]:
        """Give bites at the ends of ways in, opening by opening; `deep`: of `_ways`.

        What shaves lies there as it is, and is pressed on by one of `PRESSED_MM`.
        """
        if look.wanted is None:
            return
        bites = has_jaws(look.name)
        # before a bite it lies on the same line, as far in as walls let it
        far = len(BACKS_MM) - 1 - np.isfinite(deep)[:, ::-1].argmax(axis=1)
        waits_mm = BACKS_MM[far]
        at = np.flatnonzero(np.isfinite(deep[:, 0]) & (waits_mm <= WAITS_MM))
        lines = [each[at] for each in poses]
        bitten = self._depths(
            look.name,
            lines[0],
            BITES_MM,
            look.guard,
            free_mm=JAWS_MM if bites else -math.inf,
        )
        rows, columns = np.nonzero(np.isfinite(bitten))
        way = deep[at, far[at]][:, None]
        loss = self._loss(look, np.maximum(bitten, way), BITES_MM, lines)
        at_mm = BITES_MM[columns]
        frames = lines[0][rows]
        frames[:, :3, 3] += at_mm[:, None] * frames[:, :3, 2]
        openings = OPENINGS if bites else range(len(PRESSED_MM))
        for steps in openings if len(rows) else ():
            held = self._held(look, frames, steps, look.wanted)
            total = np.where(held > 0.0, held + loss[rows, columns], -math.inf)
            yield _Bites(at[rows], waits_mm[at[rows]], at_mm, steps, held, total)

    def _loss(
        self, look: "_Look", deep: Doubles, backs: Doubles, poses: Sequence[Doubles]
    ) -> Doubles:
        """Return what poses at places of their lines lose, ``(n, m)``, negative."""
        frames, entries, rolls = poses
        guard, up, (entry, roll) = look.guard, look.up, look.now
        worth = np.where(np.isfinite(deep), 0.0, -math.inf)
        worth -= OFF * np.abs(backs)
        worth -= DEEP * np.clip(deep, 0.0, self._most_mm)
        worth -= EVEN * np.linalg.norm(entries - self._lines.middle_mm, axis=1)[:, None]
        away_mm = np.linalg.norm(entries - entry, axis=1)
        worth -= (TURNED * _apart_deg(rolls, roll) / 180.0 + MOVED * away_mm)[:, None]
        is_other = (away_mm > 0.0) | (_apart_deg(rolls, roll) > 0.0)
        worth -= look.stays * is_other[:, None]
        for pose in look.vain:
            is_same = _apart_deg(rolls, pose.roll_deg) < 360.0 / TURNS
            is_same &= np.linalg.norm(entries - pose.entry_mm, axis=1) < VAIN_MM
            worth -= VAIN * is_same[:, None]
        if guard[6] < 0.0:
            return worth
        # where it passes the lens
        lens, back = guard[:3], guard[3:6] - guard[:3]
        ways = frames[:, :3, 3] - entries
        share = (lens - entries) @ back / (ways @ back)
        passing = entries + share[:, None] * ways - lens
        passing /= np.maximum(np.linalg.norm(passing, axis=1, keepdims=True), 1e-9)
        found: Doubles = worth - ABOVE * (1.0 + passing @ up)[:, None]
        return found

    def _held(self, look: _Look, frames: Doubles, steps: int, wanted: int) -> Doubles:
        """Return what jaws at some poses hold, ``(n,)``, less what they should not."""
        name, stride = look.name, look.stride
        counts = np.empty((len(frames), 2))
        head = kernel.Head(
            self._distance.values,
            np.ascontiguousarray(self._distance.voxel_from_world[:3]),
            self._labels.values,
            np.ascontiguousarray(self._labels.voxel_from_world[:3]),
            self._hazards.values,
            np.ascontiguousarray(self._hazards.voxel_from_world[:3]),
            UNIT_MM,
        )
        kernel.held_tissue(
            head,
            np.ascontiguousarray(frames[:, :3, 3]),
            np.ascontiguousarray(frames[:, :3, :3]),
            _between_jaws(name, steps)[::stride] - shaft_mm(name),
            _between(name, steps)[::stride],
            kernel.Prices(wanted, _costs(wanted), HURTS, CLEARS_MM, RIM_MM),
            counts,
        )
        held, cost = stride * counts.T
        return np.where(held > 0.0, held - cost, np.minimum(-cost, 0.0))

    def _normal(self, place: Doubles) -> Doubles:
        """Return the unit direction into the wall at a place."""
        off = GRADIENT_MM * np.eye(3)
        steps = self._distance.sample(np.concatenate([place + off, place - off]))
        into = steps[:3] - steps[3:]
        found: Doubles = into / max(float(np.linalg.norm(into)), 1e-9)
        return found

    def _label(self, place: Doubles) -> int:
        """Return the label of what is pointed at: what is asked for, if it is near.

        Else what lies below the lining.
        """
        into = self._normal(place)
        near = place + into + _BALL
        is_asked = self._labels.nearest(near, 0) == ASKED
        if (is_asked & (self._distance.nearest(near) > 0.0)).any():
            return ASKED
        for deep in np.arange(0.3, POINTED_MM + 0.1, 0.4):
            found = int(self._labels.nearest(place + deep * into, 0))
            if found not in _LININGS:
                return found
        return Label.MUCOSA.value


def _guard(scope: Doubles, radius_mm: float) -> Doubles:
    """Return the end of a scope's shaft, ``(7,)``, as `depths` takes it."""
    ends = scope[:3, 3], scope[:3, 3] + BESIDE_MM * scope[:3, 2]
    return np.concatenate([*ends, [radius_mm]])


def _apart_deg(turns: Doubles, turn: float) -> Doubles:
    found: Doubles = np.abs((turns - turn + 180.0) % 360.0 - 180.0)
    return found


def _pose(
    poses: Sequence[Doubles],
    number: int,
    back_mm: float,
    jaw: float = 1.0,
    bite_mm: float = 0.0,
    worth: float = 0.0,
) -> Pose:
    """Return a pose on a line, so far back from its end."""
    frames, entries, rolls = poses
    frame, roll = frames[number], math.remainder(float(rolls[number]), 360.0)
    end = frame[:3, 3] + back_mm * frame[:3, 2]
    return Pose(entries[number], end, roll, float(back_mm), jaw, bite_mm, worth)


_BALL = np.stack(np.meshgrid(*[np.arange(-2.0, 2.1, 1.0)] * 3), axis=-1).reshape(-1, 3)
_BALL = _BALL[np.linalg.norm(_BALL, axis=1) <= NEAR_ASKED_MM]
_LININGS = 0, Label.MUCOSA.value


@lru_cache(maxsize=256)
def _costs(wanted: int) -> Doubles:
    """Return what a place of each label costs, ``(256,)``."""
    costs = np.full(256, BESIDE if wanted == ASKED else OTHERS)
    costs[list(_LININGS)] = LINED
    costs[SPARED], costs[LATER] = SPARES, 0.0
    return costs


@lru_cache(maxsize=64)
def has_jaws(name: str) -> bool:
    """Return whether a tool of the catalogue bites; `NO_TOOL` does not."""
    return name != NO_TOOL and instrument_named(name).has_jaws


@lru_cache(maxsize=64)
def shaves(name: str) -> bool:
    """Return whether a tool takes what lies in a window at its side, towards its y."""
    return name != NO_TOOL and instrument_named(name).action is Action.POWERED


@lru_cache(maxsize=64)
def _is_turned(name: str) -> bool:
    """Return whether it matters how a tool is turned about its shaft."""
    aside = shaft_mm(name), works_at_mm(name)
    return has_jaws(name) or any(bool(place.any()) for place in aside)


def tip_frames(ends: Doubles, ways: Doubles, rolls_deg: Doubles) -> Doubles:
    """Return `scenarios.tip_frame` of many, ``(n, 4, 4)``."""
    back = -ways / np.linalg.norm(ways, axis=1, keepdims=True)
    is_steep = np.abs(back @ SUPERIOR) >= PARALLEL
    right = np.cross(-back, np.where(is_steep[:, None], ANTERIOR, SUPERIOR))
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    above = np.cross(back, right)
    turns = np.radians(rolls_deg)[:, None]
    frames = np.tile(np.eye(4), (len(ends), 1, 1))
    frames[:, :3, 0] = np.cos(turns) * right - np.sin(turns) * above
    frames[:, :3, 1] = np.cos(turns) * above + np.sin(turns) * right
    frames[:, :3, 2], frames[:, :3, 3] = back, ends
    return frames


def _takes(name: str) -> bool:
    """Return whether a tool takes what is at its place."""
    return has_jaws(name) or shaves(name)


def _between(name: str, steps: int) -> Doubles:
    """Return the balls of jaws that open by so many steps; none of what has none."""
    if not has_jaws(name):
        return np.zeros((0, 5))
    return np.concatenate(jaw_balls(name)[JAW_STEPS - SHUT_STEPS : steps + 1 : 3])


@lru_cache(maxsize=256)
def _between_jaws(name: str, steps: int) -> Doubles:
    """Return places of what a tool takes, ``(n, 3)`` in its frame.

    steps: by which its jaws are open, of `JAW_STEPS`; what shaves is pressed on by
    `PRESSED_MM` up to that number.
    """
    if shaves(name):
        # an edge at rest is a capsule
        rows = instrument_named(name).working_volume(np.eye(4))
        rows[:, 7] = rows[:, 13]
        pressed = [rows.copy() for _ in range(steps + 1)]
        for row, mm in zip(pressed, PRESSED_MM, strict=False):
            row[:, [2, 5]] += mm
        rows = np.concatenate(pressed)
    else:
        jaw = 1.0 - steps / JAW_STEPS
        rows = instrument_named(name).working_volume(np.eye(4), jaw)
    rows[:, 7] += ROUGH_MM
    starts, ends, radii = rows[:, 1:4], rows[:, 4:7], rows[:, 7]
    if not len(rows):
        return np.zeros((0, 3))
    low = np.minimum(starts, ends).min(axis=0) - radii.max()
    high = np.maximum(starts, ends).max(axis=0) + radii.max()
    axes = [
        np.arange(a, b + APART_MM, APART_MM) for a, b in zip(low, high, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside: Doubles = places[in_capsules(rows, places)]
    return inside
