"""A hand that operates as one is taught to: seen, gently, and along the shaft.

It does the tasks of `ScriptedHand` with the same bites, and moves as people do: in
movements of least jerk, drawn back along the shaft before it is brought elsewhere. The
scope lies where it sees the tool and touches nothing. What presses too hard, breaks
bone or hurts is taken back, and something else is tried.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from devices.recording.probe_path import slerp
from paravol.exercises.scripted_hand import Bite, ScriptedHand, middle_of
from paravol.inputs.hand import nostril_fulcrum
from paravol.inputs.jaw import CLOSING_S, OPENING_S, Jaw
from paravol.inputs.nostril_lines import LEAN_MM, RINGS, NostrilLines
from paravol.inputs.pointed_tool import thickness_mm
from scenarios import InstrumentState, Sample, tip_frame
from scenarios.instrument_state import EMPTY_HAND, NO_TOOL
from scenarios.instruments.catalogue import instrument_named
from scenarios.instruments.contact_shape import shaft_mm
from scenarios.tasks.rules import is_in_sight
from scenarios.tasks.task import Inject, LookTask

Doubles = NDArray[np.float64]

RATE_HZ = 50.0
SCOPE_MM_S, TOOL_MM_S, TURN_DEG_S = 30.0, 60.0, 90.0
"""How fast hands go and turn on the average, at most."""
LEAST_S = 0.3
"""No movement is shorter."""

CLEAR_MM, BESIDE_MM = 0.3, -0.4
"""So much air a scope has about its shaft; and so far it lies from the tool's."""
NEAREST_MM, FARTHEST_MM, BEST_MM = 9.0, 26.0, 15.0
"""A scope looks at a tool from so far; and best from so far."""
ROOM_MM = 1.0
"""More air about a scope is not better."""
MOVED, NEARER, ASIDE = 0.02, 0.03, 0.01
"""What a place of the scope loses for each mm that it has to be moved and that it is
off the best distance, and for each degree off the middle of the picture."""
SEEN_MM = 3.0
"""So far behind a tool's tip its shaft is seen."""
RIM_DEG = 5.0
"""What is looked at keeps so far from the rim of the field."""
BACK_MM = 0.0, 3.0, 6.0, 10.0, 15.0, 22.0, 32.0, 45.0
"""So far a shaft is drawn back before it is turned: what suffices is taken."""
WAITS_MM, EASES_MM = 6.0, 3.0
"""Jaws open so far before what they bite; and so far behind it nothing is pressed."""
STUCK_MM = 0.5
"""A tool passes walls so deep, at most, on its way."""
MOST_N, EASY_N = 17.0, 9.0
"""More force is not brought to tissue, nor more than the second where nothing is
worked at: bone cracks at 5 to 15 N."""
SPARED_MM = 0.25
"""Nothing comes nearer to what must not be hurt."""
OTHER = 0.4
"""Another tool than the one in hand is worth so much less."""
LEADS_MM = 10.0
"""So much deeper than the scope a tool is, or the scope draws back."""
WITHDRAWN_MM, AHEAD_MM = 8.0, 18.0
"""While tools are changed the scope waits so deep in the nose, and sees them come; once
they are so deep both go on together."""
FELT, TRIES, AWAY = 1500, 60, 0.1
"""So many ways to a place that is felt are thought of, and tried; a mm off it counts
as so many mm in tissue."""
SWAP_S, SHAVES_S = 0.6, 0.4
OUTSIDE_MM = 8.0
"""A tool that is changed is so far before the nostril."""


class _TooHardError(Exception):
    """A try pressed too hard, broke bone or hurt."""


@dataclass(frozen=True, slots=True)
class _Held:
    """A shaft: its tip and where its hand is from there, ``(3,)`` each, and its turn.

    back: of length 1.
    """

    tip: Doubles
    back: Doubles
    roll_deg: float = 0.0

    def drawn(self, by_mm: float) -> "_Held":
        """Return it drawn back along its shaft."""
        return replace(self, tip=self.tip + by_mm * self.back)

    def at(self, other: "_Held", share: float) -> "_Held":
        """Return it on its way to another place."""
        return _Held(
            self.tip + share * (other.tip - self.tip),
            slerp(self.back, other.back, share),
            self.roll_deg + share * (other.roll_deg - self.roll_deg),
        )

    def seconds(self, other: "_Held", mm_s: float) -> float:
        """Return how long the way to another place takes."""
        moved_mm = float(np.linalg.norm(other.tip - self.tip))
        cosine = float(np.clip(self.back @ other.back, -1.0, 1.0))
        turned_deg = max(
            abs(other.roll_deg - self.roll_deg), math.degrees(math.acos(cosine))
        )
        if moved_mm < 0.01 and turned_deg < 0.1:
            return 0.0
        return max(moved_mm / mm_s, turned_deg / TURN_DEG_S, LEAST_S)

    @property
    def frame(self) -> Doubles:
        """Return its tip's frame, 4x4."""
        return tip_frame(self.tip, -self.back, self.roll_deg)


@dataclass
class ModelHand(ScriptedHand):
    """Do a scenario's tasks as a film of them should show it."""

    scope_deg: float | None = None
    pressed_mm: ClassVar[float] = 1.3
    _name: str = field(default=NO_TOOL, init=False)
    _jaw: float = field(default=1.0, init=False)
    _works: bool = field(default=False, init=False)
    _sucks: bool = field(default=False, init=False)
    _spared_mm: float = field(default=-math.inf, init=False)
    _presses: bool = field(default=False, init=False)
    _opens: float | None = field(default=None, init=False)
    _pedal: Jaw = field(default_factory=Jaw, init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        fulcrum = nostril_fulcrum(self.patient, None, self.scenario.start)
        lines = NostrilLines(fulcrum, self.distance, LEAN_MM, RINGS)
        self._scope_places = lines.places_mm
        self._scope_at = _Held(self._pivot - 10.0 * self._axis, -self._axis)
        self._tool_at = _Held(self._pivot - 40.0 * self._axis, -self._axis)
        self._random = np.random.default_rng(6)

    # moving

    def _move(
        self,
        seconds: float,
        scope: _Held | None = None,
        tool: _Held | None = None,
        jaw: float | None = None,
    ) -> None:
        """Bring all there at once; everything starts and ends at rest."""
        begin = self._scope_at, self._tool_at, self._jaw
        end = (
            scope or begin[0],
            tool or begin[1],
            begin[2] if jaw is None else jaw,
        )
        count = max(math.ceil(seconds * RATE_HZ - 1e-9), 1)
        for number in range(1, count + 1):
            u = number / count
            share = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
            self._scope_at = begin[0].at(end[0], share)
            self._tool_at = begin[1].at(end[1], share)
            # jaws follow a pedal evenly
            self._jaw = begin[2] + u * (end[2] - begin[2])
            self._record()

    def _record(self) -> None:
        if self.samples:
            self.time_s = round(self.time_s + 1.0 / RATE_HZ, 4)
        scope, tool, state = self._scope_at, self._tool_at, EMPTY_HAND
        # as a pedal moves them where this is played, and with the digits of a file
        jaw = max(self._pedal.at(self.time_s, self._works), self._jaw)
        if self._name != NO_TOOL:
            state = InstrumentState(
                self._name,
                round(tool.roll_deg, 3),
                round(jaw, 4),
                self._works,
                self._sucks,
            )
        sample = Sample(
            self.time_s,
            tip_frame(scope.tip.round(4), -scope.back.round(6)),
            round(scope.roll_deg, 3),
            tool.tip.round(4),
            -tool.back.round(6),
            0,
            state,
            scope_deg=self.scope_deg,
        )
        self.samples.append(sample)
        self.session.step(sample)
        operation = self._operation
        if operation is None:
            return
        operation.take_edits()
        operation.take_injuries()
        touch = operation.touch
        most_n = MOST_N if self._presses else EASY_N
        if touch.size_n > most_n or touch.broken or operation.injured:
            raise _TooHardError
        if self._nearest_mm() < min(SPARED_MM, self._spared_mm):
            raise _TooHardError

    def _nearest_mm(self) -> float:
        """Return how near anything came so far to what must not be hurt."""
        watch = None if self._operation is None else self._operation.injuries
        near = [] if watch is None else list(watch.approaches.values())
        return min((each.gap_mm for each in near), default=math.inf)

    @contextmanager
    def _tried(self, *, is_kept: bool = True) -> Iterator[list[bool]]:
        """Take back what presses too hard; the list then holds something.

        is_kept: what goes well stays done.
        """
        kept = (
            self._scope_at,
            self._tool_at,
            self._name,
            self._jaw,
            self._works,
            self._sucks,
            self.time_s,
            copy(self._pedal),
        )
        count, before = len(self.samples), self.session.checkpoint()
        failed: list[bool] = []
        # what was near before may stay so near
        spared_mm, self._spared_mm = self._spared_mm, self._nearest_mm() - 1e-9
        try:
            yield failed
            if math.isinf(self._harm()):
                raise _TooHardError
        except _TooHardError:
            failed.append(True)
        self._spared_mm = spared_mm
        if failed or not is_kept:
            self.session.restore(before)
            del self.samples[count:]
            self._scope_at, self._tool_at, self._name, self._jaw = kept[:4]
            self._works, self._sucks, self.time_s, self._pedal = kept[4:]
            self._presses = False

    def _way(
        self, begin: _Held, end: _Held, depth_mm: Callable[[_Held], float], most: float
    ) -> list[_Held]:
        """Return the corners of a way that passes no wall deeper than this.

        Where there is none, of the way farthest back.
        """
        most = max(most, depth_mm(begin), depth_mm(end)) + 0.05
        corners: list[_Held] = []
        for back_mm in BACK_MM:
            corners = [begin, begin.drawn(back_mm), end.drawn(back_mm), end]
            between = (
                one.at(other, share)
                for one, other in pairwise(corners)
                for share in np.linspace(0.0, 1.0, 7)[1:-1]
            )
            if all(depth_mm(held) <= most for held in between):
                break
        return corners[1:]

    def _scope_depth_mm(self, held: _Held) -> float:
        """Return how deep a scope's shaft lies in tissue, less than 0 for air."""
        inside_mm = float((held.tip - self._pivot) @ self._axis) + 3.0
        if inside_mm <= 0.0:
            return -9.0
        points = held.tip + np.linspace(0.0, inside_mm, 40)[:, None] * held.back
        return float(self.distance.sample(points).max() + self._scope.diameter_mm / 2)

    def _tool_depth_mm(self, held: _Held, name: str) -> float:
        """Return the same of a tool."""
        points = middle_of(shaft_mm(name))
        frame = held.frame
        points = frame[:3, 3] + points @ frame[:3, :3].T
        points = points[(points - self._pivot) @ self._axis > -2.0]
        if not len(points):
            return -9.0
        return float(self.distance.sample(points).max() + thickness_mm(name))

    # the scope

    def go(self, tip: Doubles, entry: Doubles, roll_deg: float) -> None:
        """Bring the scope to a place, through another of the nostril."""
        self._lay(_Held(tip, _unit(entry - tip), self._turned(roll_deg)))

    def back(self) -> None:
        """Leave the scope: it is drawn back as far as its next place asks."""

    def stay(self, seconds: float) -> None:
        """Hold everything where it is."""
        self._move(seconds)

    def choose(self, angle_deg: float | None) -> None:
        """Take another scope: this one goes out, and that one comes in."""
        self._away()
        out_mm = float((self._scope_at.tip - self._pivot) @ self._axis) + OUTSIDE_MM
        out = self._scope_at.drawn(max(out_mm, 0.0))
        self._move(self._scope_at.seconds(out, SCOPE_MM_S), scope=out)
        self._move(SWAP_S)
        self.scope_deg = angle_deg

    def look(self, task: LookTask) -> None:
        """Find a place from which the task's is seen, and go there."""
        near = max(task.nearest_mm + 0.5, NEAREST_MM)
        self.see(self.place(task.place), near, min(task.farthest_mm - 0.5, 30.0))

    def see(
        self, place: Doubles, near_mm: float = NEAREST_MM, far_mm: float = FARTHEST_MM
    ) -> None:
        """Take the tool out and look at a place."""
        self._away()
        found = self._seeing(place, place, None, near_mm, far_mm)
        assert found is not None, f"{place} is seen from nowhere"
        self._lay(found)

    def _turned(self, roll_deg: float) -> float:
        """Return a turn by the nearest way from the present one."""
        now = self._scope_at.roll_deg
        return now + math.remainder(roll_deg - now, 360.0)

    def _lay(self, scope: _Held) -> None:
        if scope is self._scope_at:
            return
        for corner in self._scope_way(scope):
            self._move(self._scope_at.seconds(corner, SCOPE_MM_S), scope=corner)

    def _scope_way(self, scope: _Held) -> list[_Held]:
        return self._way(self._scope_at, scope, self._scope_depth_mm, -CLEAR_MM)

    def _seeing(
        self,
        place: Doubles,
        sight: Doubles,
        tool: tuple[str, _Held] | None,
        near_mm: float = NEAREST_MM,
        far_mm: float = FARTHEST_MM,
    ) -> _Held | None:
        """Return where a scope sees a place and touches nothing; None for nowhere.

        sight: what must not be hidden. tool: it keeps clear of that.
        """
        angle = self._scope.at(self.scope_deg).angle_deg
        widest = self._scope.field_of_view_deg / 2 - RIM_DEG
        radius = self._scope.diameter_mm / 2
        tips = self._random.normal(size=(8000, 3))
        tips /= np.linalg.norm(tips, axis=1, keepdims=True)
        tips = place + self._random.uniform(near_mm, far_mm, (8000, 1)) * tips
        tips = np.vstack([self._scope_at.tip, tips])
        is_free = self.distance.sample(tips) < -radius - CLEAR_MM
        is_free &= (tips - self._pivot) @ self._axis > 5.0
        tips = tips[is_free]
        entries = self._scope_places
        number = np.repeat(np.arange(len(tips)), len(entries))
        tips, entries = tips[number], np.tile(entries, (len(is_free[is_free]), 1))
        ways = entries - tips
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        ahead = place - tips
        away = np.linalg.norm(ahead, axis=1)
        cosine = -(ways * ahead).sum(1) / np.maximum(away, 1e-9)
        off = np.abs(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))) - angle)
        kept = (off < widest) & (away > near_mm) & (away < far_mm)
        tips, entries, ways, away, off = (
            each[kept] for each in (tips, entries, ways, away, off)
        )
        share = np.linspace(0.0, 1.0, 24)[:, None]
        lines = tips[:, None] + share * (entries - tips)[:, None]
        clear = -radius - self.distance.sample(lines).max(axis=1)
        kept = clear > CLEAR_MM
        if tool is not None:
            name, held = tool
            shaft = middle_of(shaft_mm(name))[::2]
            frame = held.frame
            shaft = frame[:3, 3] + shaft @ frame[:3, :3].T
            apart_mm = radius + thickness_mm(name) + BESIDE_MM
            for n in np.flatnonzero(kept):
                between = lines[n][:, None] - shaft
                kept[n] = (between**2).sum(2).min() > apart_mm**2
        moved = np.linalg.norm(tips - self._scope_at.tip, axis=1)
        worth = np.minimum(clear, ROOM_MM) - MOVED * moved - ASIDE * off
        worth -= NEARER * np.abs(away - BEST_MM)
        for n in np.argsort(-worth):
            if kept[n] and is_in_sight(self.distance, tips[n], sight):
                roll = self._roll_towards(tips[n], -ways[n], place)
                return _Held(tips[n], ways[n], self._turned(roll))
        return None

    def _sees(self, place: Doubles, sight: Doubles, tool: tuple[str, _Held]) -> bool:
        """Return whether the scope sees a place well enough from where it is."""
        scope, radius = self._scope_at, self._scope.diameter_mm / 2
        name, held = tool
        if self._scope_depth_mm(scope) > -CLEAR_MM + 0.05:
            return False
        angle = math.radians(self._scope.at(self.scope_deg).angle_deg)
        frame = tip_frame(scope.tip, -scope.back, scope.roll_deg)
        # the light post's side is where the scope looks
        view = -math.cos(angle) * frame[:3, 2] + math.sin(angle) * frame[:3, 1]
        ahead = place - scope.tip
        away = float(np.linalg.norm(ahead))
        if not NEAREST_MM <= away <= FARTHEST_MM:
            return False
        off = math.degrees(math.acos(np.clip(view @ ahead / away, -1.0, 1.0)))
        shaft = held.frame[:3, 3] + middle_of(shaft_mm(name)) @ held.frame[:3, :3].T
        line = scope.tip + np.linspace(0.0, 60.0, 40)[:, None] * scope.back
        apart = np.linalg.norm(line[:, None] - shaft, axis=2).min()
        return (
            off < self._scope.field_of_view_deg / 2 - RIM_DEG
            and apart > radius + thickness_mm(name) + BESIDE_MM
            and is_in_sight(self.distance, scope.tip, sight)
        )

    # the tool

    def use(self, name: str, target: _Held, work: Callable[[], None]) -> bool:
        """Bring a tool to a place, work there, and draw it back.

        Return whether that pressed nowhere too hard; else it did not happen.
        """
        off = target.frame[:3, :3] @ shaft_mm(name)
        sight, tool = target.drawn(SEEN_MM).tip + off, (name, target)
        scope = self._scope_at
        if not self._sees(target.tip, sight, tool):
            found = self._seeing(target.tip, sight, tool)
            if found is None:
                return False
            scope = found
        with self._tried() as failed:
            wait = target.drawn(WAITS_MM)
            if name != self._name:
                self._away()
                self._bring(name, wait, scope)
            else:
                if scope is not self._scope_at:
                    self._lay(self._before(self._tool_at, scope))
                roll = self._tool_at.roll_deg
                roll += math.remainder(wait.roll_deg - roll, 360.0)
                wait, target = (replace(h, roll_deg=roll) for h in (wait, target))

                def depth(held: _Held) -> float:
                    return self._tool_depth_mm(held, name)

                for corner in self._way(self._tool_at, wait, depth, STUCK_MM):
                    self._carry(corner, scope)
                self._carry(wait, scope)
            self._presses = True
            self._into(target, work)
            near = target.drawn(EASES_MM)
            self._move(target.seconds(near, TOOL_MM_S / 2), tool=near)
            self._presses = False
            free = next(
                (
                    held
                    for held in map(target.drawn, BACK_MM[2:])
                    if self._tool_depth_mm(held, name) < 0.0
                ),
                wait,
            )
            self._carry(free, scope)
            # nothing holds it on its way out
            with self._tried(is_kept=False) as held_back:
                self._away()
            if held_back:
                raise _TooHardError
        return not failed

    def _into(self, target: _Held, work: Callable[[], None]) -> None:
        if self._opens is not None:
            self._move(OPENING_S * (1.0 - self._opens), jaw=self._opens)
        self._move(self._tool_at.seconds(target, TOOL_MM_S / 3), tool=target)
        work()

    def _deep_mm(self, held: _Held) -> float:
        """Return how deep in the nose a shaft's tip is."""
        return float((held.tip - self._pivot) @ self._axis)

    def _carry(self, tool: _Held, scope: _Held) -> None:
        """Bring the tool to a place; a scope before which it would be draws back."""
        here = self._before(tool, scope)
        seconds = max(
            self._tool_at.seconds(tool, TOOL_MM_S),
            self._scope_at.seconds(here, 1.5 * SCOPE_MM_S),
        )
        self._move(seconds, scope=here, tool=tool)

    def _before(self, tool: _Held, scope: _Held) -> _Held:
        """Return a scope drawn back until it sees a tool's tip."""
        return self._at_depth(scope, max(self._deep_mm(tool) - LEADS_MM, 1.0))

    def _at_depth(self, held: _Held, deep_mm: float) -> _Held:
        """Return a shaft drawn back until its tip is no deeper than this."""
        along = float(-held.back @ self._axis)
        return held.drawn(max(self._deep_mm(held) - deep_mm, 0.0) / along)

    def _bring(self, name: str, wait: _Held, scope: _Held) -> None:
        """Bring a tool in from outside; the scope sees it come."""
        outside = self._at_depth(wait, -OUTSIDE_MM)
        here = self._at_depth(scope, WITHDRAWN_MM)
        for corner in self._way(self._scope_at, here, self._scope_depth_mm, -CLEAR_MM):
            seconds = self._scope_at.seconds(corner, SCOPE_MM_S)
            self._move(seconds, scope=corner, tool=outside)
        self._tool_at = outside
        self._name, self._jaw = name, 1.0
        ahead = self._at_depth(wait, AHEAD_MM)
        self._move(outside.seconds(ahead, TOOL_MM_S * 1.5), tool=ahead)
        seconds = max(here.seconds(scope, SCOPE_MM_S), ahead.seconds(wait, TOOL_MM_S))
        self._move(seconds, scope=scope, tool=wait)

    def _away(self) -> None:
        """Take the tool out, if there is one; the scope goes back with it."""
        if self._name == NO_TOOL:
            return
        here = self._at_depth(self._scope_at, WITHDRAWN_MM)
        ahead = self._at_depth(self._tool_at, AHEAD_MM)
        seconds = max(
            self._scope_at.seconds(here, SCOPE_MM_S),
            self._tool_at.seconds(ahead, TOOL_MM_S),
        )
        self._move(seconds, scope=here, tool=ahead)
        out = self._at_depth(ahead, -OUTSIDE_MM)
        self._move(ahead.seconds(out, TOOL_MM_S * 1.5), tool=out)
        self._name, self._works, self._sucks = NO_TOOL, False, False
        self._move(SWAP_S)

    def inject(self, task: Inject) -> None:
        """Put the needle into the nearest tissue that it reaches."""
        place = self.place(task.place)
        points = self._ball(place, task.radius_mm - 0.1)
        depth = self.distance.sample(points)
        points = points[(depth > 0.1) & (depth < 0.8 * task.deepest_mm)][:200]
        tips, entries, dents = self._lines(points, task.deepest_mm + 0.5)

        def press() -> None:
            self._works = True
            self._move(task.hold_s + 0.2)
            self._works = False

        for n in np.argsort(dents)[:25]:
            target = _Held(tips[n], _unit(entries[n] - tips[n]))
            if self.use(task.tool, target, press):
                return
        raise AssertionError(f"{task.name}: it is not reached gently")

    def touch(
        self, name: str, place: Doubles, seconds: float, within_mm: float
    ) -> bool:
        """Hold a tool's tip near a place, in air; a tool that sucks does."""
        points = self._ball(place, within_mm)
        depth = self.distance.sample(points)
        points = points[(depth < -0.3) & (depth > -2.5)][:300]
        has_suction = instrument_named(name).suction_ml_s > 0.0

        def hold() -> None:
            self._sucks = has_suction
            self._move(seconds)
            self._sucks = False

        ways: list[tuple[float, _Held]] = []
        for _ in range(FELT):
            point, entry = self._random.choice(points), self._random.choice(self._hands)
            roll_deg = float(self._random.uniform(-180.0, 180.0))
            frame = tip_frame(point, point - entry, roll_deg)
            back = _unit(entry - point - frame[:3, :3] @ shaft_mm(name))
            held = _Held(point, back, roll_deg)
            worth = self._tool_depth_mm(held, name)
            worth += AWAY * float(np.linalg.norm(point - place))
            ways.append((worth, held))
        ways.sort(key=lambda way: way[0])
        return any(self.use(name, held, hold) for _, held in ways[:TRIES])

    def _worth(self, bite: Bite, wanted: Doubles, price: float) -> float:
        worth = super()._worth(bite, wanted, price)
        return worth if bite.name == self._name else OTHER * worth

    def _close(self, bite: Bite) -> bool:
        target = _Held(bite.frame[:3, 3], bite.frame[:3, 2], bite.roll_deg)
        tool = instrument_named(bite.name)

        def shave() -> None:
            self._works = self._sucks = True
            self._move(SHAVES_S)
            self._works = self._sucks = False

        def close() -> None:
            self._works = True
            self._move(CLOSING_S * (1.0 - bite.jaw) + 0.1, jaw=1.0)
            self._works = False

        self._opens = None if tool.needs_suction else bite.jaw
        try:
            return self.use(bite.name, target, shave if tool.needs_suction else close)
        finally:
            self._opens = None


def _unit(way: Doubles) -> Doubles:
    return way / np.linalg.norm(way)
