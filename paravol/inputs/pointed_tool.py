"""A tool that goes where somebody points in the picture, through the nostril and beside
the scope.

The place is a ray of the scope's camera and a way along it. `tool_plan` says how the
tool is to lie there; here it goes there as a careful hand does: where walls leave no
other way it is drawn back along its own line, turned, and put in along the new one.
Walls hold it all the while, and it slides along them.
"""

import math
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from devices.controls.fulcrum import Fulcrum
from paravol.inputs.picture_ray import FARTHEST_MM, ray_of, reach_mm
from paravol.inputs.tool_hold import BITES_MM, SPARES_MM, ToolHold
from paravol.inputs.tool_plan import (
    SHUT_STEPS,
    Pose,
    ToolPlan,
    has_jaws,
    shaves,
)
from renderers.scene import Camera, Volume
from scenarios import InstrumentState, tip_frame
from scenarios.instruments.contact_shape import JAW_STEPS, contact_table
from surgery.contact import between

Doubles = NDArray[np.float64]

NEAREST_MM = 4.0
"""Where a tip lies before the lens, at least."""

OUTSIDE_MM = 15.0
"""A tool that was taken waits so far before the nostril."""

TIP_MM_S, ENTRY_MM_S, TURN_DEG_S = 60.0, 20.0, 180.0
"""How fast tip, place in the nostril and turn follow what is wanted."""

LUNGE_MM = 5.0
"""A tool that works so near to the tissue that it points at is brought to it."""

STEP_S, LONGEST_S = 0.01, 0.1
"""It moves in steps of samples' time, and after a pause on as after the most."""

SHUT = SHUT_STEPS / JAW_STEPS
"""A bite closes jaws farther (`scenarios.operation.CLOSED`)."""

PLANNED_S, ANEW_MM = 0.1, 0.3
"""How often poses are compared, and how far place or scope have moved then."""

MOVING_S = 0.3
"""The same while somebody goes on pointing elsewhere, where that takes time of others:
who comes to rest is answered at once."""

MOST_N = 4.0
"""Against more no hand moves on: a scope is pressed with 2.2 N on average (Eur Arch
Otorhinolaryngol 2008)."""

LEVER_MM = 20.0
"""It turns no faster than one that is so deep."""

AIMED, SAME_MM, SAME_DEG = 0.03, 1.0, 4.0
"""Sine of the angle to its line, way from its entry and turn at which a tool goes in,
at most."""

DRAWN_MM = np.array([0.0, 3.0, 6.0, 10.0, 15.0, 22.0, 30.0, 40.0])
"""So far a tool is drawn back to be turned, as little as will do."""

DRAWN_MORE_MM = 6.0
"""Where it cannot be turned there, it is drawn back so much more."""

BETWEEN = 6
"""Poses on the way from one to another that are looked at."""

TRAIL_MM = 0.5
"""Between the places of its way in that are remembered."""

TURNS_DEG, LEANS = (0.0, -10.0, 10.0, -25.0, 25.0), 0.06
AROUND = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
"""Where walls hold it on its way out it is turned by one of the first, and tilted by
the second, to one of the sides."""

NEAR_MM = 2.5
"""A tip so near to its place has come there."""

TURNS_IN_MM = 0.05
"""A turn in a step that dents walls by more is not made."""

PUSHED_MM = 4.5
"""From so near a push brings it to its bite, though walls hold it off till then."""

TRIES = 4
"""So many other ways to a place are tried."""

NEARER_MM, PATIENCE_S = 0.5, 0.5
"""A tip that comes no nearer to its place by this for so long is stuck."""

TOLD_S = 0.5
"""Who presses so soon after a bite was told means that one, where the tool and what is
pointed at are still near."""

HELD_MM = 8.0
"""One that is still there has come as far as it can."""


@dataclass(frozen=True, slots=True)
class _Told:
    """A bite, when it was worked out, for which place, and the tool's frame."""

    bite: tuple[Doubles, float]
    time_s: float
    place: Doubles
    frame: Doubles

    def is_meant(self, place: Doubles, frame: Doubles, time_s: float) -> bool:
        """Return whether somebody who presses now means it."""
        ways = place - self.place, frame[:3, 3] - self.frame[:3, 3]
        away_mm = max(float(np.linalg.norm(way)) for way in ways)
        return time_s < self.time_s + TOLD_S and away_mm < NEAR_MM


class PointedTool:
    """Bring a tool to places of a picture.

    has_come: whether the tip has been at its place since it was put in. is_stuck: it
    cannot come nearer to its place. withdraws: it leaves, wherever somebody points:
    may be set. reach_mm: where tissue begins along the ray. bite:
    frame of the shaft, 4x4, where it would bite, and how far its jaws are closed there;
    None for nothing.
    """

    def __init__(
        self,
        fulcrum: Fulcrum,
        hold: ToolHold,
        distance: Volume,
        plan: ToolPlan | None = None,
    ) -> None:
        """Begin outside.

        fulcrum: of the nostril. distance: signed air distance of the head, mm, read as
        it is at the time. plan: how it lies; one that only knows the walls by default.
        """
        self.hold = hold
        self.plan = plan or ToolPlan(fulcrum, distance)
        self._distance = distance
        self._pivot, self._axis = fulcrum.pivot_mm, fulcrum.axis
        self.reach_mm = math.inf
        self._last_s: float | None = None
        self.ask: Callable[[str | None], None] = lambda _: None
        """Is told the open task by its name: bites mean what it asks for."""
        self.withdraws = False
        self.beside: Executor | None = None
        """Compares poses meanwhile; None to wait for that."""
        self.put_in()

    def put_in(self) -> None:
        """Begin outside."""
        self._entry, self._way = self._pivot, self._axis
        self.depth_mm = -OUTSIDE_MM
        self._roll_deg = 0.0
        end = self._pivot + self._axis
        self._pose = Pose(self._pivot, end, 0.0, math.inf)
        self._planned_s, self._planned_for = -math.inf, np.full(7, np.inf)
        self._asked: tuple[Future[Pose], Doubles] | None = None
        self._looked_s, self._looked_for = -math.inf, self._planned_for
        self._moves = False
        self._drawn_mm = -math.inf
        self._vain: list[Pose] = []
        self._vain_at = self._pivot
        self._leaves: tuple[Doubles, float] | None = None
        self.has_come = self.is_stuck = False
        self._is_held = self._is_resting = False
        self._may_bite: bool | None = None
        self.bite: tuple[Doubles, float] | None = None
        self._planned: _Told | None = None
        self._told: _Told | None = None
        self._stroke, self._is_biting, self._has_opened = 0.0, False, False
        self._stroke_mm = math.inf
        self._least_mm, self._still_s = math.inf, 0.0
        self._trail: list[tuple[Doubles, Doubles, float, float, Doubles]] = []
        self.frame = self._rod(self._entry, self._way, self.depth_mm, 0.0)

    @property
    def shut(self) -> float:
        """Return how far its jaws stay closed: on its way in. 0 in its place."""
        return 0.0 if self.has_come else SHUT

    @property
    def is_there(self) -> bool:
        """Return whether it is at its place."""
        left_mm = float(np.linalg.norm(self._pose.end_mm - self.frame[:3, 3]))
        return self.has_come and left_mm < NEAR_MM

    @property
    def pressed(self) -> Doubles:
        """Return the frame to which a pedal presses it."""
        frame = self.frame.copy()
        frame[:3, 3] += self._pose.bite_mm * frame[:3, 1]
        return frame

    @property
    def closes(self) -> bool:
        """Return whether its pedal closes its jaws; for a bite they open first."""
        return self.bite is None or self._has_opened

    def rest(self, *, is_working: bool) -> float:
        """Return how far its jaws are closed while its pedal does not close them.

        They open in their place, and with the pedal down alone.
        """
        opens = is_working and self.bite is not None and self._stroke >= 1.0
        return self.bite[1] if opens and self.bite is not None else SHUT

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
        deeper. time_s: of the sample. felt_n: what the hand felt last.
        """
        eye, ray = camera.eye_mm, ray_of(camera, at)
        self.hold.state = state
        self.hold.beside(scope, radius_mm)
        self.reach_mm = reach_mm(self._distance, eye, ray)
        bites = state.is_working and has_jaws(state.name)
        if not bites:
            self._may_bite = None
        elif self._may_bite is None:
            # who presses means what was told, not what a tremor has made of it since;
            # on the way there nothing was
            place = eye + self.reach_mm * ray
            for told in (self._planned, self._told):
                if told is not None and told.is_meant(place, self.frame, time_s):
                    self.bite = told.bite
            self._may_bite = self.bite is not None
        self._is_biting = bool(self._may_bite) and self.bite is not None
        if self._is_biting or self._stroke > 0.0:
            return self._bites(state, time_s)
        if self.withdraws:
            last_s, self._last_s = self._last_s, time_s
            elapsed_s = 0.0 if last_s is None else min(time_s - last_s, LONGEST_S)
            self._go_back(TIP_MM_S * max(elapsed_s, 0.0))
            self._planned_s, self.bite, self.is_stuck = -math.inf, None, False
            return self.frame
        lunge_mm = LUNGE_MM if state.is_working else NEAR_MM
        is_at_tissue = self.reach_mm - ahead_mm < lunge_mm
        bite_mm = BITES_MM * state.jaw if state.is_working and not bites else 0.0
        tip_mm = self.reach_mm if is_at_tissue else ahead_mm
        if state.is_working and shaves(state.name):
            # one stroke takes one layer, from where it lies: that was told
            if math.isinf(self._stroke_mm):
                turn_deg = self._roll_deg - state.roll_deg
                self._pose = self._pose._replace(
                    entry_mm=self._entry, end_mm=self.frame[:3, 3], roll_deg=turn_deg
                )
                before_mm = float(np.linalg.norm(self._planned_for[:3] - eye))
                self._stroke_mm = min(before_mm, FARTHEST_MM)
            # a ray that trembles over an edge moves it no nearer and no farther
            tip_mm = self._stroke_mm
        else:
            self._stroke_mm = math.inf
        pressed = bite_mm * ray
        if shaves(state.name):
            pressed = self._pose.bite_mm * state.is_working * self.frame[:3, 1]
        place = eye + tip_mm * ray + pressed
        self._choose(place, scope, camera, radius_mm, state, time_s, is_at_tissue)
        self.bite = None
        left_s = STEP_S
        if self._last_s is not None:
            left_s = min(max(time_s - self._last_s, 0.0), LONGEST_S)
        self._last_s = time_s
        while left_s > 1e-6:
            step_s = min(STEP_S, left_s)
            left_s -= step_s
            eases = felt_n > MOST_N and not state.is_working
            self.hold.push(
                bite_mm, felt_n, step_s, is_held=self._is_held and not self._is_resting
            )
            self._go(state, step_s, eases)
        pose = self._pose
        if pose.jaw < 1.0 and not math.isfinite(self._drawn_mm):
            way, depth_mm, roll_deg = self._wanted(state)
            end = self._rod(pose.entry_mm, way, depth_mm + pose.bite_mm, roll_deg)
            if self.is_there or self._gets_to(end):
                self.bite = end, pose.jaw
                place = self._planned_for[:3]
                self._planned = _Told(self.bite, time_s, place, self.frame)
        return self.frame

    def warm_up(self, state: InstrumentState, frame: Doubles) -> None:
        """Compile what following needs; frame: somewhere in the nose, 4x4."""
        self.hold.state = state
        self.hold.beside(frame, 1.0)
        reach_mm(self._distance, frame[:3, 3], frame[:3, 2])
        self.hold.warm_up(frame)
        self.plan.warm_up(state.name, frame)

    def _gets_to(self, end: Doubles) -> bool:
        """Return whether a push brings it to a bite from where walls hold it off."""
        left_mm = float(np.linalg.norm(self._pose.end_mm - self.frame[:3, 3]))
        if not self.has_come or left_mm > PUSHED_MM:
            return False
        spared_mm, _ = self.hold.harm(self.frame, end[None])
        return bool(spared_mm[0] >= SPARES_MM)

    def tell(self) -> tuple[Doubles, float] | None:
        """Return the bite, which somebody is told of now: who presses means it."""
        if self.bite is not None and self._stroke == 0.0:
            self._told = self._planned
        return self.bite

    def _bites(self, state: InstrumentState, time_s: float) -> Doubles:
        """Go on about what is to be bitten, open there and close; then go back."""
        assert self.bite is not None
        last_s, self._last_s = self._last_s, time_s
        elapsed_s = 0.0 if last_s is None else min(max(time_s - last_s, 0.0), LONGEST_S)
        end, jaw = self.bite
        share = elapsed_s * TIP_MM_S / max(self._pose.bite_mm, 1.0)
        if not self._is_biting:
            self._has_opened = False
            # open jaws do not go back
            if state.jaw > SHUT - 0.5 / JAW_STEPS:
                self._stroke = max(self._stroke - share, 0.0)
            # what was there is gone
            self._planned_for = np.full(7, np.inf)
        else:
            self._stroke = min(self._stroke + share, 1.0)
            is_open = self._stroke >= 1.0 and state.jaw < jaw + 0.5 / JAW_STEPS
            self._has_opened = self._has_opened or is_open
        return between(self.frame, end, self._stroke)

    def stay(self, state: InstrumentState, time_s: float) -> Doubles:
        """Stay; return the shaft's frame, 4x4."""
        self.hold.state = state
        if self._stroke > 0.0:
            self._is_biting = False
            return self._bites(state, time_s)
        self._last_s = time_s
        return self.frame

    def _choose(
        self,
        place: Doubles,
        scope: Doubles,
        camera: Camera,
        radius_mm: float,
        state: InstrumentState,
        time_s: float,
        is_at_tissue: bool,
    ) -> None:
        """Choose how it is to lie, and how far it is drawn back for that."""
        is_held = state.is_working and bool(np.isfinite(self._planned_for).all())
        if self._asked is not None and self._asked[0].done():
            (asked, seen), self._asked = self._asked, None
            pose = asked.result()
            if not is_held:
                self._take(pose, seen, state, scope, radius_mm)
        if self._planned_s <= time_s < self._planned_s + PLANNED_S:
            return
        lies = scope[:3, 3] + LEVER_MM * scope[:3, 2]
        seen = np.concatenate([place, lies, [state.roll_deg / SAME_DEG]])
        is_new = float(np.abs(seen - self._planned_for).max()) > ANEW_MM
        if is_new and not is_held:
            if not self._looked_s <= time_s < self._looked_s + PLANNED_S:
                moved = np.abs(seen - self._looked_for).max()
                self._moves = bool(moved > ANEW_MM)
                self._looked_s, self._looked_for = time_s, seen
            waits = self._planned_s <= time_s < self._planned_s + MOVING_S
            waits = waits and self._moves and self.beside is not None
            if self._asked is not None or waits:
                return
            if float(np.linalg.norm(place - self._vain_at)) > NEAR_MM:
                self._vain, self._vain_at = [], place
            choose = partial(
                self.plan.choose,
                name=state.name,
                place=place,
                scope=scope,
                radius_mm=radius_mm,
                up=camera.frame[2],
                now=(self._pose.entry_mm, self._pose.roll_deg),
                vain=tuple(self._vain),
                is_at_tissue=is_at_tissue,
            )
            if self.beside is None:
                self._take(choose(), seen, state, scope, radius_mm)
            else:
                self._asked = self.beside.submit(choose), seen
        elif is_new:
            # while it works it follows the place as it lies
            off = place - self._planned_for[:3]
            self._planned_for = seen
            self._pose = self._pose._replace(end_mm=self._pose.end_mm + off)
        self._planned_s = time_s

    def _take(
        self,
        pose: Pose,
        seen: Doubles,
        state: InstrumentState,
        scope: Doubles,
        radius_mm: float,
    ) -> None:
        """Have a pose that was chosen for what was `seen`."""
        self._pose, self._planned_for = pose, seen
        self._least_mm, self._still_s = math.inf, 0.0
        self._is_resting = self.is_stuck = False
        self._drawn_mm = self._drawn(state, scope, radius_mm)

    def _wanted(self, state: InstrumentState) -> tuple[Doubles, float, float]:
        """Return its line's direction, how deep on it it goes, and its turn."""
        pose = self._pose
        way = pose.end_mm - pose.entry_mm
        depth_mm = max(float(np.linalg.norm(way)), 1e-9)
        way = way / depth_mm
        if math.isinf(pose.off_mm):
            depth_mm = -OUTSIDE_MM
        return way, depth_mm, pose.roll_deg + state.roll_deg

    def _drawn(self, state: InstrumentState, scope: Doubles, radius_mm: float) -> float:
        """Return how deep it is where it can be turned to its line."""
        way, depth_mm, roll_deg = self._wanted(state)
        if self._is_aimed(way, roll_deg):
            return math.inf
        if self.depth_mm <= 0.0:
            return 0.0
        turn_deg = math.remainder(roll_deg - self._roll_deg, 360.0)
        for back_mm in DRAWN_MM:
            drawn_mm = min(self.depth_mm, depth_mm) - float(back_mm)
            if drawn_mm <= 0.0:
                break
            frames = []
            for share in np.linspace(0.0, 1.0, BETWEEN)[1:]:
                entry = self._entry + share * (self._pose.entry_mm - self._entry)
                line = self._way + share * (way - self._way)
                line /= np.linalg.norm(line)
                roll = self._roll_deg + share * turn_deg
                frames.append(self._rod(entry, line, drawn_mm, roll))
            if self.plan.is_free(state.name, scope, radius_mm, np.stack(frames)):
                return drawn_mm
        return 0.0

    def _is_aimed(self, way: Doubles, roll_deg: float) -> bool:
        """Return whether it lies on its line already, as far as a hand sees."""
        return (
            float(np.linalg.norm(way - self._way)) < AIMED
            and float(np.linalg.norm(self._entry - self._pose.entry_mm)) < SAME_MM
            and abs(math.remainder(roll_deg - self._roll_deg, 360.0)) < SAME_DEG
        )

    def _go(self, state: InstrumentState, step_s: float, eases: bool) -> None:
        """Move for one step towards its place, or out along its line."""
        way, depth_mm, roll_deg = self._wanted(state)
        most_mm = TIP_MM_S * step_s
        if self._is_aimed(way, roll_deg) and math.isfinite(self._drawn_mm):
            # it has been turned: in it goes, and out along this line
            self._drawn_mm, self._trail = math.inf, []
        if eases or self.depth_mm > self._drawn_mm + SAME_MM:
            self._go_back(most_mm)
            return
        self._leaves = None
        depth_mm = min(depth_mm, self._drawn_mm)
        step_mm = min(max(depth_mm - self.depth_mm, -most_mm), most_mm)
        # entry, line and turn change together, as `_drawn` has looked at them
        left_deg = math.remainder(roll_deg - self._roll_deg, 360.0)
        lever_mm = max(self.depth_mm, LEVER_MM)
        needed_s = max(
            float(np.linalg.norm(self._pose.entry_mm - self._entry)) / ENTRY_MM_S,
            float(np.linalg.norm(way - self._way)) * lever_mm / TIP_MM_S,
            abs(left_deg) / TURN_DEG_S,
        )
        share = min(step_s / max(needed_s, 1e-9), 1.0)
        entry = self._entry + share * (self._pose.entry_mm - self._entry)
        turned = self._way + share * (way - self._way)
        turned /= np.linalg.norm(turned)
        rolled_deg = self._roll_deg + share * left_deg
        self._step(entry, turned, step_mm, rolled_deg)
        self._leave_trail()
        self._watch(step_s)

    def _step(
        self, entry: Doubles, turned: Doubles, step_mm: float, rolled_deg: float
    ) -> None:
        """Move its shaft to a line, and along it, as far as walls let it."""
        before = self.frame
        wanted = self._rod(entry, turned, self.depth_mm + step_mm, rolled_deg)
        self.hold.move_to(entry)
        held = self.hold(before, wanted)
        if held is not wanted and self.hold.gains_mm(before, held) > TURNS_IN_MM:
            # what sticks out of a shaft that is wedged turns into no wall
            rolled_deg = self._roll_deg
            wanted = self._rod(entry, turned, self.depth_mm + step_mm, rolled_deg)
            held = self.hold(before, wanted)
        self.frame, self._roll_deg = held, rolled_deg
        self._is_held = held is not wanted
        if held is wanted:
            self._entry, self._way = entry, turned
            self.depth_mm += step_mm
        else:
            self._way = -held[:3, 2]
            tip = held[:3, 3]
            self._entry = tip + float((entry - tip) @ self._way) * self._way
            self.depth_mm = float((tip - self._entry) @ self._way)

    def _go_back(self, way_mm: float) -> None:
        """Go out the way that it came in, and on along its line and walls."""
        while way_mm > 0.0 and self._trail:
            entry, way, depth_mm, roll_deg, frame = self._trail.pop()
            way_mm -= float(np.linalg.norm(frame[:3, 3] - self.frame[:3, 3]))
            way_mm -= LEVER_MM * float(np.linalg.norm(way - self._way))
            way_mm -= abs(roll_deg - self._roll_deg) * TIP_MM_S / TURN_DEG_S
            self._entry, self._way, self.depth_mm = entry, way, depth_mm
            self._roll_deg, self.frame = roll_deg, frame
        if way_mm <= 0.0 or self.depth_mm <= -OUTSIDE_MM:
            return
        before, entry, way = self.frame, self._entry, self._way
        depth_mm = self.depth_mm - way_mm
        self._step(entry, way, -way_mm, self._roll_deg)
        gone_mm = float((self.frame[:3, 3] - before[:3, 3]) @ before[:3, 2])
        if gone_mm < way_mm / 2.0:
            self._force_out(entry, way, depth_mm, before)

    def _force_out(
        self, entry: Doubles, way: Doubles, depth_mm: float, before: Doubles
    ) -> None:
        """Go out though walls hold it, turned and tilted as it does least harm."""
        if self._leaves is None:
            self._leaves = way, self._roll_deg
        # about the line by which it began to leave: what it leans does not add up
        way, roll_deg = self._leaves
        x, y = before[:3, 0], before[:3, 1]
        lines = [way, *(way + LEANS * (a * x + b * y) for a, b in AROUND)]
        lines = [line / np.linalg.norm(line) for line in lines]
        choices = [
            (line, roll_deg + turn_deg) for turn_deg in TURNS_DEG for line in lines
        ]
        frames = np.stack(
            [self._rod(entry, line, depth_mm, roll) for line, roll in choices]
        )
        spared_mm, dents_mm = self.hold.harm(before, frames)
        best = int(np.lexsort((dents_mm, -spared_mm))[0])
        self._way, self._roll_deg = choices[best]
        self._entry, self.depth_mm = entry, depth_mm
        self.frame = frames[best]

    def _leave_trail(self) -> None:
        """Remember the way in, without what was gone twice."""
        place = self.frame[:3, 3]
        if self._trail:
            places = np.array([each[4][:3, 3] for each in self._trail])
            ways = np.array([each[1] for each in self._trail])
            rolls = np.array([each[3] for each in self._trail])
            off = np.linalg.norm(places - place, axis=1)
            off += LEVER_MM * np.linalg.norm(ways - self._way, axis=1)
            off += np.abs(rolls - self._roll_deg) / SAME_DEG
            near = np.flatnonzero(off < TRAIL_MM)
            if len(near):
                del self._trail[int(near[0]) + 1 :]
                return
        self._trail.append(
            (self._entry, self._way, self.depth_mm, self._roll_deg, self.frame)
        )

    def _watch(self, step_s: float) -> None:
        """See whether it has come, or cannot come nearer."""
        if math.isinf(self._pose.off_mm):
            self.is_stuck = True
            return
        left_mm = float(np.linalg.norm(self._pose.end_mm - self.frame[:3, 3]))
        is_turning = math.isfinite(self._drawn_mm)
        if left_mm < self._least_mm - NEARER_MM or (is_turning and not self._is_held):
            self._least_mm, self._still_s = left_mm, 0.0
        elif self._asked is None:
            # else it is about to go elsewhere
            self._still_s += step_s
        is_still = self._still_s > PATIENCE_S
        if is_still and math.inf > self._drawn_mm > 0.0:
            # walls keep it from turning there: farther out they leave more room
            self._drawn_mm = min(self._drawn_mm, self.depth_mm) - DRAWN_MORE_MM
            self._least_mm, self._still_s = math.inf, 0.0
            return
        if is_turning:
            return
        if left_mm < NEAR_MM:
            self.has_come, self.is_stuck = True, self._pose.off_mm > HELD_MM
        elif is_still and len(self._vain) < TRIES:
            self._vain.append(self._pose)
            self._planned_for = np.full(7, np.inf)
            self._least_mm, self._still_s = math.inf, 0.0
        elif is_still and left_mm < HELD_MM:
            # walls hold it off: there it rests
            self.has_come = self._is_resting = True
        elif is_still:
            self.is_stuck = True

    def _rod(
        self, entry: Doubles, way: Doubles, depth_mm: float, roll_deg: float
    ) -> Doubles:
        return tip_frame(entry + depth_mm * way, way, roll_deg)


@lru_cache(maxsize=64)
def thickness_mm(name: str) -> float:
    """Return the radius of a tool's shaft, mm."""
    return float(contact_table(name, 1.0)[:, 6].max())
