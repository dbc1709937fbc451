"""A tool whose tip follows a place in the picture, through the nostril and beside the
scope.

The place is a ray of the scope's camera and a way along it. The tool's shaft is a line
through the nostril, which yields by some millimetres; of these lines the one is taken
that keeps farthest from walls and from the scope. Walls hold it, and it slides along
them. A tool is put in along its line, from outside. Where something lies between its
tip and its place, it is drawn out and put in along another line.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from devices.controls.fulcrum import Fulcrum
from paravol.inputs.nostril_lines import NostrilLines
from paravol.inputs.tool_hold import BESIDE_MM, BITES_MM, PUSH_N, ToolHold
from paravol.inputs.wrist import Wrist, has_jaws
from renderers.scene import Camera, Volume
from scenarios import InstrumentState, tip_frame
from scenarios.instruments.contact_shape import (
    JAW_STEPS,
    contact_table,
    shaft_mm,
    works_at_mm,
)

Doubles = NDArray[np.float64]

NEAREST_MM, FARTHEST_MM = 4.0, 60.0
"""Where a tip lies before the lens, at least and at most."""

OUTSIDE_MM = 15.0
"""A tool that was taken waits so far before the nostril."""

TIP_MM_S, ENTRY_MM_S, TURN_DEG_S = 60.0, 20.0, 180.0
"""How fast tip, place in the nostril and turn follow what is wanted."""

LUNGE_MM = 5.0
"""A tool that begins to work goes so far to the tissue that it points at."""

STEP_MM = 0.2
"""Shortest step on the way along a ray to tissue."""

STEP_S, LONGEST_S = 0.01, 0.1
"""It moves in steps of samples' time, and after a pause on as after the most."""

ENTRY_MM, RINGS = 5.0, 2
"""How far a shaft may be off the nostril's middle, and the rings of places that are
tried. The phantom's nostril is 9 mm high and 6 mm wide, and soft."""

ASIDE_MM = 4.0
"""How far beside its place a tip may go, where scope or walls leave no other way."""

EASY_MM = 0.4
"""So little air as a line lacks costs nothing."""

BETTER_MM = 0.1
"""More air about a line is not better; so much more is worth a change."""

PASSES_MM, HARD = 0.2, 4.0
"""Between scope and tool; what is lacking there counts for so many times as much as at
a wall, which yields."""

EVEN, ASTRAY = 0.02, 0.25
"""What a line is off the nostril's middle, and off its place, counts as so much less
air."""

SHUT = 0.88
"""A bite closes jaws farther (`scenarios.operation.CLOSED`)."""

ABOVE = 0.4
"""So much less air a line above the lens is worth than one beside it, and that than one
below: there a tool hides little, and a surgeon holds it there. What did not come in
so is brought in any way."""

PLANNED_S = 0.1
"""How often lines are compared."""

MOST_N = 3.0
"""Against more no hand moves on: a scope is pressed with 2.2 N on average (Eur Arch
Otorhinolaryngol 2008)."""

TRAIL_MM = 1.0
"""Between the places of its way in that are remembered."""

AIMED = 0.03
"""Sine of the angle to its line at which a tool goes in, at most."""

LEVER_MM = 20.0
"""It turns no faster than one that is so deep."""

NEAR_MM = 2.5
"""A tip so near to its place has come there."""

TURNS_IN_MM = 0.05
"""A turn in a step that dents walls by more is not made."""

NEARER_MM, PATIENCE_S = 0.5, 0.5
"""A tip that comes no nearer to its place by this for so long is stuck."""

HELD_MM, FAR_MM = 8.0, 16.0
"""One that is still there has come as far as it can: it is not tried anew. The second
where it had come to another place before."""

SAME_MM, TRIES, FAILED_MM = 4.0, 2, 1.5
"""A place so near to another is the same: so many other lines are tried for it, whose
places in the nostril lie farther apart."""


class PointedTool:
    """Bring a tool's tip to places of a picture.

    has_come: whether the tip has been at its place since it was put in. is_stuck: it
    cannot come nearer to its place. reach_mm: where tissue begins along the ray.
    """

    def __init__(
        self,
        fulcrum: Fulcrum,
        hold: ToolHold,
        distance: Volume,
        wrist: Wrist | None = None,
    ) -> None:
        """Begin outside.

        fulcrum: of the nostril. distance: signed air distance of the head, mm, read as
        it is at the time. wrist: turns it; one that only knows the walls by default.
        """
        self.hold = hold
        self._wrist = wrist or Wrist(distance)
        self._distance = distance
        self._pivot, self._axis = fulcrum.pivot_mm, fulcrum.axis
        self._lines = lines = NostrilLines(fulcrum, distance, ENTRY_MM, RINGS)
        self._entries = lines.places_mm
        self._asides = lines.off * (ASIDE_MM / ENTRY_MM)
        self.reach_mm = math.inf
        self._last_s: float | None = None
        self.put_in()

    def put_in(self) -> None:
        """Begin outside."""
        self._entry, self._way = self._pivot, self._axis
        self.depth_mm = -OUTSIDE_MM
        self._roll_deg = self._side_deg = 0.0
        self._grip_mm = np.zeros(3)
        self._best, self._aside = self._pivot, np.zeros(3)
        self._planned_s = -math.inf
        self.has_come = self.is_stuck = self._is_backing = False
        self._is_held = self._is_resting = False
        self._narrow, self._is_biting = 0.0, False
        self._goal, self._least_mm, self._still_s = self._pivot, math.inf, 0.0
        self._tried_mm: Doubles | None = None
        self._failed: list[Doubles] = []
        self._trail: list[tuple[Doubles, Doubles, float, Doubles]] = []
        self.frame = self._rod(self._entry, self._way, self.depth_mm)

    @property
    def shut(self) -> float:
        """Return how far its jaws stay closed: on its way in, and out.

        0 in its place. Jaws that are closed all the way on their way out would bite.
        """
        if self._is_backing:
            return SHUT
        return 0.0 if self.has_come else 1.0

    @property
    def rest(self) -> float:
        """Return how far its jaws are closed while nobody bites, 0 to 1.

        In its place they open as far as walls let them.
        """
        return max(self.shut, self._narrow)

    def follow(
        self,
        camera: Camera,
        scope: Doubles,
        radius_mm: float,
        at: tuple[float, float],
        ahead_mm: float,
        state: InstrumentState,
        time_s: float,
        felt_n: float = 0.0,
    ) -> Doubles:
        """Go on towards a place of the picture; return the shaft's frame, 4x4.

        scope, radius_mm: its tip's frame, 4x4, and its shaft. at: right and up from the
        picture's middle, 1 at its rim. ahead_mm: along that ray; the tip stops where
        tissue begins. While the tool works it goes there from nearby, and a bite
        deeper. time_s: of the sample.
        felt_n: what the hand felt last.
        """
        eye, ray = camera.eye_mm, ray_of(camera, at)
        self.hold.state = state
        self.hold.beside(scope, radius_mm)
        self.reach_mm = reach_mm(self._distance, eye, ray)
        bites = state.is_working and has_jaws(state.name)
        if bites and not self._is_biting:
            self._is_biting = self._wrist.holds_tissue(state.name, self.frame)
        if not bites:
            self._is_biting = False
        elif self._is_biting:
            # what lies between the jaws is taken, and nothing else
            self._last_s = time_s
            return self.frame
        bite_mm = BITES_MM * state.jaw if state.is_working and not bites else 0.0
        tip_mm = min(ahead_mm, self.reach_mm)
        if state.is_working and self.reach_mm - tip_mm < LUNGE_MM:
            # whoever works wants to be at the tissue that he points at
            tip_mm = self.reach_mm
        tip = eye + (tip_mm + bite_mm) * ray
        # on its way in it is turned as it fits through the nostril
        roll_deg = state.roll_deg + (self._side_deg if self.has_come else 0.0)
        goal = tip
        for _ in range(2):
            # a bent tool's shaft passes beside its tip
            turn = tip_frame(goal, goal - self._best, roll_deg)[:3, :3]
            goal = tip + turn @ (shaft_mm(state.name) - self._grip_mm)
        is_planned = not self._planned_s <= time_s < self._planned_s + PLANNED_S
        if is_planned:
            self._plan(
                goal, scope, camera.frame[2], radius_mm, thickness_mm(state.name)
            )
            self._planned_s = time_s
            if not state.is_working and self.reach_mm - tip_mm < LUNGE_MM:
                place = eye + self.reach_mm * ray
                self._side_deg = self._wrist.turn_deg(
                    state.name, self.frame, place, self._side_deg
                )
                self._grip_mm = works_at_mm(state.name)
        goal = goal + self._aside
        if not state.is_working and (is_planned or state.jaw > self._narrow):
            self._narrow = min(self.hold.narrow(self.frame), SHUT)
        if felt_n > PUSH_N and not state.is_working:
            # nor do they open on against what presses back
            self._narrow = max(self._narrow, min(state.jaw, SHUT))
        left_s = STEP_S
        if self._last_s is not None:
            left_s = min(max(time_s - self._last_s, 0.0), LONGEST_S)
        self._last_s = time_s
        while left_s > 1e-6:
            step_s = min(STEP_S, left_s)
            left_s -= step_s
            if felt_n > MOST_N and not state.is_working and self._trail:
                # a hand that feels so much eases off, the way that it came
                self._narrow = SHUT
                self._go_back(TIP_MM_S * step_s, to_the_end=False)
                self._watch(goal, step_s)
                continue
            self.hold.push(
                bite_mm, felt_n, step_s, is_held=self._is_held and not self._is_resting
            )
            self._go(goal, roll_deg, step_s)
        return self.frame

    def stay(self, state: InstrumentState, time_s: float) -> Doubles:
        """Stay; return the shaft's frame, 4x4."""
        self.hold.state = state
        self._last_s = time_s
        return self.frame

    def _plan(
        self,
        goal: Doubles,
        scope: Doubles,
        up: Doubles,
        radius_mm: float,
        thick_mm: float,
    ) -> None:
        """Choose the line to a place that keeps farthest from walls and scope.

        up: of the picture; a line below the lens is better than one above.
        """
        entries = np.repeat(self._entries, len(self._asides), axis=0)
        asides = np.tile(self._asides, (len(self._entries), 1))
        entries = np.vstack([self._best, entries])
        asides = np.vstack([self._aside, asides])
        ways = goal + asides - entries
        points = self._lines.points(entries, goal + asides)
        lacks = self._lines.lacks_mm(points, thick_mm - EASY_MM)
        lens, back = scope[:3, 3], scope[:3, 2]
        along = np.clip((points - lens) @ back, 0.0, BESIDE_MM)
        off = np.linalg.norm(points - lens - along[..., None] * back, axis=2)
        beside = off.min(axis=1) - radius_mm - thick_mm - PASSES_MM
        # where it passes the plane of the lens
        share = (lens - entries) @ back / (ways @ back)
        passing = entries + share[:, None] * ways - lens
        passing /= np.maximum(np.linalg.norm(passing, axis=1, keepdims=True), 1e-9)
        # wide enough is good enough: then the nostril's middle is, and the place itself
        worth = -lacks.max(axis=1) - 2.0 * lacks.mean(axis=1)
        worth += HARD * np.minimum(beside, 0.0)
        if not self._failed:
            worth -= ABOVE * (1.0 + passing @ up)
        worth -= EVEN * np.linalg.norm(entries - self._pivot, axis=1)
        worth -= ASTRAY * np.linalg.norm(asides, axis=1)
        for failed in self._failed:
            worth[np.linalg.norm(entries - failed, axis=1) < FAILED_MM] -= HARD
        best = int(np.argmax(worth))
        if worth[best] > worth[0] + BETTER_MM:
            self._best, self._aside = entries[best], asides[best]

    def _go(self, goal: Doubles, roll_deg: float, step_s: float) -> None:
        """Move for one step towards a place of the shaft's end."""
        before = self.frame
        if self._is_backing:
            self._go_back(TIP_MM_S * step_s)
            return
        way = goal - self._best
        depth_mm = float(np.linalg.norm(way))
        way = way / depth_mm
        entry = self._entry + _cut(self._best - self._entry, ENTRY_MM_S * step_s)
        lever_mm = max(self.depth_mm, LEVER_MM)
        turned = self._way + _cut(way - self._way, TIP_MM_S * step_s / lever_mm)
        turned /= np.linalg.norm(turned)
        step_mm = min(depth_mm - self.depth_mm, TIP_MM_S * step_s)
        is_aimed = float(np.linalg.norm(way - turned)) < AIMED and (
            float(np.linalg.norm(entry - self._best)) < NEAR_MM
        )
        if self.depth_mm <= 0.0 and step_mm > 0.0 and not is_aimed:
            step_mm = 0.0
        step_mm = max(step_mm, -TIP_MM_S * step_s)
        left_deg = math.remainder(roll_deg - self._roll_deg, 360.0)
        most_deg = TURN_DEG_S * step_s
        rolled_deg = self._roll_deg
        self._roll_deg += min(max(left_deg, -most_deg), most_deg)
        wanted = self._rod(entry, turned, self.depth_mm + step_mm)
        self.hold.move_to(entry)
        held = self.hold(before, wanted)
        if held is not wanted and self.hold.gains_mm(before, held) > TURNS_IN_MM:
            # what sticks out of a shaft that is wedged turns into no wall
            self._roll_deg = rolled_deg
            wanted = self._rod(entry, turned, self.depth_mm + step_mm)
            held = self.hold(before, wanted)
        self.frame = held
        if held is wanted:
            self._entry, self._way = entry, turned
            self.depth_mm += step_mm
            self._is_held = False
        else:
            self._is_held = True
            self._way = -held[:3, 2]
            tip = held[:3, 3]
            self._entry = tip + float((entry - tip) @ self._way) * self._way
            self.depth_mm = float((tip - self._entry) @ self._way)
        self._leave_trail()
        self._watch(goal, step_s)

    def _go_back(self, way_mm: float, *, to_the_end: bool = True) -> None:
        """Go out the way that it came in: bent tools hook behind nothing.

        to_the_end: it goes on to the outside, and in again then. It waits for open
        jaws, which would take along what they meet.
        """
        state = self.hold.state
        if state.jaw < SHUT - 1.0 / JAW_STEPS and has_jaws(state.name):
            return
        while way_mm > 0.0 and self._trail:
            entry, way, depth_mm, frame = self._trail.pop()
            way_mm -= float(np.linalg.norm(frame[:3, 3] - self.frame[:3, 3]))
            self._entry, self._way, self.depth_mm = entry, way, depth_mm
            self.frame = frame
        if to_the_end and not self._trail:
            self._is_backing = self.has_come = False

    def _leave_trail(self) -> None:
        """Remember the way in, without what was gone twice."""
        place = self.frame[:3, 3]
        if self._trail:
            places = np.array([each[3][:3, 3] for each in self._trail])
            ways = np.array([each[1] for each in self._trail])
            off = np.linalg.norm(places - place, axis=1)
            off += LEVER_MM * np.linalg.norm(ways - self._way, axis=1)
            near = np.flatnonzero(off < TRAIL_MM)
            if len(near):
                del self._trail[int(near[0]) + 1 :]
                return
        self._trail.append((self._entry, self._way, self.depth_mm, self.frame))

    def _watch(self, goal: Doubles, step_s: float) -> None:
        """See whether it has come, or is stuck and is to be tried anew."""
        left_mm = float(np.linalg.norm(goal - self.frame[:3, 3]))
        if float(np.linalg.norm(goal - self._goal)) > NEARER_MM:
            self._goal, self._least_mm, self._still_s = goal, math.inf, 0.0
            self._is_resting = False
        if left_mm < NEAR_MM:
            self.has_come, self.is_stuck = True, False
        if left_mm < NEAR_MM or left_mm < self._least_mm - NEARER_MM:
            self._least_mm, self._still_s = left_mm, 0.0
            return
        self._still_s += step_s
        if self._still_s < PATIENCE_S:
            return
        if left_mm < HELD_MM or (self.has_come and left_mm < FAR_MM):
            # walls hold it off: there it rests, and its jaws may open
            self.has_come, self.is_stuck = True, False
            self._is_resting = True
            return
        tried = self._tried_mm
        if tried is None or float(np.linalg.norm(tried - goal)) > SAME_MM:
            self._tried_mm, self._failed = goal, []
        self._failed.append(self._best)
        self.is_stuck = len(self._failed) > TRIES
        self._is_backing = not self.is_stuck
        self._least_mm, self._still_s = math.inf, 0.0

    def _rod(self, entry: Doubles, way: Doubles, depth_mm: float) -> Doubles:
        return tip_frame(entry + depth_mm * way, way, self._roll_deg)


@lru_cache(maxsize=64)
def thickness_mm(name: str) -> float:
    """Return the radius of a tool's shaft, mm."""
    return float(contact_table(name, 1.0)[:, 6].max())


def _cut(way: Doubles, most: float) -> Doubles:
    """Return a way, no longer than the most."""
    length = float(np.linalg.norm(way))
    return way if length <= most else way * (most / length)


def ray_of(camera: Camera, at: tuple[float, float]) -> Doubles:
    """Return the unit direction, ``(3,)``, of a place in a round picture.

    at: right and up from the middle, 1 at the rim; what lies beyond it is at the rim.
    """
    _, right, up, forward = camera.frame
    away = math.hypot(*at)
    if away < 1e-9:
        return np.array(forward)
    angle = min(away, 1.0) * camera.extent
    aside = (at[0] * right + at[1] * up) / away
    found: Doubles = math.cos(angle) * forward + math.sin(angle) * aside
    return found


def reach_mm(distance: Volume, eye_mm: Doubles, along: Doubles) -> float:
    """Return how far ahead along a ray tissue begins, mm; infinite for nowhere near."""
    if not np.all(np.isfinite(eye_mm + along)):
        return math.inf
    matrix = distance.voxel_from_world
    start, way = matrix[:3, :3] @ eye_mm + matrix[:3, 3], matrix[:3, :3] @ along
    at_mm = before_mm = before = 0.0
    while at_mm < FARTHEST_MM:
        here = distance.at_voxel(start + at_mm * way)
        if here >= 0.0:
            if before < 0.0:
                share = before / (before - here)
                at_mm = before_mm + share * (at_mm - before_mm)
            return at_mm
        before_mm, before = at_mm, here
        at_mm += max(-here, STEP_MM)
    return math.inf
