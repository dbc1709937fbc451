"""When a task is done, and when it has failed: one rule for each kind.

A rule sees one situation after the other, in order of time. It keeps what it must
remember in fields whose values never change, so that a shallow copy is a whole one.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Volume
from scenarios.endoscope import LEAST_GRAVITY, SUPERIOR
from scenarios.tasks import task as tasks
from scenarios.tasks.head_parts import Head
from scenarios.tasks.neck import Neck
from scenarios.tasks.situation import Situation

ABSENT_S = 0.5
"""Longer than this between two samples, nobody knows what happened meanwhile: what must
last begins anew."""

SIGHT_STEP_MM = 0.25
"""Between places along a line of sight: no wall is thinner than half of this."""

NEAR_TARGET_MM = 1.5
"""So near to its end a line of sight may be in tissue: landmarks lie on the mucosa."""

WITHIN = 1.5
"""A landmark that lies within what it names, such as the head of a turbinate, is seen
where its surface is: so many times its depth before it, for lines that are oblique."""

Places = Mapping[str, NDArray[np.float64]]


class Rule(ABC):
    """Follow one task.

    progress: 0 to 1, which is done. failed: why it cannot be done any more, "" while
    it can. lacks: what is left to do, in figures, "" where there are none. is_kept:
    done only at the end, when it has not failed until then.
    """

    is_kept = False

    def __init__(self) -> None:
        self.progress = 0.0
        self.failed = self.lacks = ""

    @abstractmethod
    def step(self, now: Situation, elapsed_s: float) -> None:
        """Take in one situation; elapsed_s: since the last one, 0 at first."""


class _Dwell(Rule):
    """Done when a condition has held for some seconds at a stretch."""

    def __init__(self, hold_s: float) -> None:
        super().__init__()
        self._hold_s = hold_s
        self._held_s: float | None = None

    @abstractmethod
    def _holds(self, now: Situation) -> bool:
        """Return whether the condition holds."""

    def step(self, now: Situation, elapsed_s: float) -> None:
        if not self._holds(now):
            self._held_s, self.progress = None, 0.0
            return
        if self._held_s is None or elapsed_s > ABSENT_S:
            self._held_s = 0.0
        else:
            self._held_s += elapsed_s
        if self._held_s >= self._hold_s:
            self.progress = 1.0
        else:
            self.progress = self._held_s / self._hold_s


class _Reach(_Dwell):
    def __init__(self, task: tasks.Reach, places: Places) -> None:
        super().__init__(task.hold_s)
        self._task = task
        self._place = _at(task.place, places)

    def _holds(self, now: Situation) -> bool:
        tip = _tip(now, self._task.held)
        return tip is not None and _apart(tip, self._place) <= self._task.radius_mm


class _Look(_Dwell):
    def __init__(self, task: tasks.LookTask, places: Places) -> None:
        super().__init__(task.hold_s)
        self._task = task
        self._place = _at(task.place, places)

    def _holds(self, now: Situation) -> bool:
        task, frame = self._task, now.camera.frame
        away = self._place - frame[0]
        distance = float(np.linalg.norm(away))
        if not task.nearest_mm <= distance <= task.farthest_mm:
            return False
        if away @ frame[3] < distance * math.cos(math.radians(task.within_deg)):
            return False
        if task.level_deg < 180.0 and not _is_level(frame, task.level_deg):
            return False
        return is_in_sight(now.distance, frame[0], self._place)


class _Hold(_Dwell):
    def __init__(self, task: tasks.Hold, places: Places) -> None:
        super().__init__(task.hold_s)
        self._task = task
        self._place = _at(task.place, places)
        self._begun: NDArray[np.float64] | None = None

    def _holds(self, now: Situation) -> bool:
        tip = _tip(now, self._task.held)
        if tip is None or _apart(tip, self._place) > self._task.radius_mm:
            self._begun = None
            return False
        if self._begun is None:
            self._begun = tip
        elif _apart(tip, self._begun) > self._task.still_mm:
            # the hold begins anew where the tip is now
            self._begun = tip
            return False
        return True


class _Follow(Rule):
    def __init__(self, task: tasks.Follow, places: Places) -> None:
        super().__init__()
        self._task = task
        self._middles = [_at(ring.place, places) for ring in task.rings]
        self._axes = [np.array(ring.axis) for ring in task.rings]
        self._passed = 0
        self._last: NDArray[np.float64] | None = None

    def step(self, now: Situation, elapsed_s: float) -> None:
        tip = _tip(now, self._task.held)
        last, self._last = self._last, tip
        if tip is None or last is None or elapsed_s > ABSENT_S:
            return
        count = len(self._task.rings)
        # one step may pass several
        while self._passed < count and self._passes(last, tip):
            self._passed += 1
        self.progress = self._passed / count

    def _passes(self, last: NDArray[np.float64], tip: NDArray[np.float64]) -> bool:
        middle, axis = self._middles[self._passed], self._axes[self._passed]
        before, after = (last - middle) @ axis, (tip - middle) @ axis
        if not before < 0.0 <= after:
            return False
        crossing = last + before / (before - after) * (tip - last)
        return _apart(crossing, middle) <= self._task.rings[self._passed].radius_mm


class _Inject(_Dwell):
    def __init__(self, task: tasks.Inject, places: Places) -> None:
        super().__init__(task.hold_s)
        self._task = task
        self._place = _at(task.place, places)

    def _holds(self, now: Situation) -> bool:
        task, tip = self._task, now.tool_tip_mm
        if now.tool != task.tool or tip is None or not now.is_working:
            return False
        if _apart(tip, self._place) > task.radius_mm:
            return False
        depth_mm = float(now.distance.sample(tip))
        return 0.0 <= depth_mm <= task.deepest_mm


class _Remove(Rule):
    def __init__(self, task: tasks.Remove, head: Head | None) -> None:
        super().__init__()
        self._task = task
        self.is_kept = not task.asks
        self._edits: int | None = None
        self._parts = {name: head.part(name) for name in task.parts} if head else {}

    def step(self, now: Situation, elapsed_s: float) -> None:
        if now.books is None or now.edits == self._edits:
            return
        self._edits = now.edits
        shares: list[float] = []
        lacks: list[str] = []
        for name, share in self._task.parts.items():
            part = self._parts.get(name)
            percent = 0.0
            if part is not None and now.fill is not None:
                percent = part.taken_percent(now.fill)
            if percent > share.most_percent:
                self.failed = (
                    f"{percent:.0f} % of {name} taken, "
                    f"{share.most_percent:g} at most allowed"
                )
            if share.least_percent > 0.0:
                shares.append(min(percent / share.least_percent, 1.0))
                lacks.append(f"{name}: {100.0 - percent:.0f} % left")
        for limits, taken in (
            (self._task.tissues, now.books.tissues()),
            (self._task.walls, now.wall_mm3),
        ):
            for name, limit in limits.items():
                volume = taken.get(name, 0.0)
                if limit.most_mm3 is not None and volume > limit.most_mm3:
                    self.failed = (
                        f"{volume:.1f} mm3 of {name} taken, "
                        f"{limit.most_mm3:g} at most allowed"
                    )
                if limit.least_mm3 > 0.0:
                    shares.append(min(volume / limit.least_mm3, 1.0))
                    lacks.append(f"{volume:.1f} of {limit.least_mm3:g} mm3 of {name}")
        self.lacks = ", ".join(lacks)
        self.progress = float(np.mean(shares)) if shares else 1.0


class _Open(Rule):
    def __init__(self, task: tasks.Open, places: Places, head: Head | None) -> None:
        super().__init__()
        self._task = task
        self._ends = _at(task.start, places), _at(task.end, places)
        self._neck = Neck.between(head.distance, *self._ends) if head else None
        self._edits: int | None = None

    def step(self, now: Situation, elapsed_s: float) -> None:
        if now.edits == self._edits:
            return
        self._edits = now.edits
        task = self._task
        if self._neck is None:
            # nobody knows the head from before
            self._neck = Neck.between(now.distance, *self._ends)
        area_mm2, radius_mm = self._neck.opening(now.distance)
        self.progress = min(radius_mm / task.radius_mm, 1.0)
        self.lacks = f"a ball of {radius_mm:.1f} mm passes"
        if task.area_mm2 > 0.0:
            self.progress = min(self.progress, area_mm2 / task.area_mm2)
            self.lacks = f"{area_mm2:.1f} of {task.area_mm2:g} mm2"


class _KeepAway(Rule):
    is_kept = True

    def __init__(self, task: tasks.KeepAway) -> None:
        super().__init__()
        self._task = task
        self._doses_s = dict.fromkeys(task.hazards, 0.0)
        self._nearness = dict.fromkeys(task.hazards, 0.0)

    def step(self, now: Situation, elapsed_s: float) -> None:
        task = self._task
        doses, nearness = dict(self._doses_s), dict(self._nearness)
        for name in task.hazards:
            if name in now.injured:
                self.failed = f"{name} was hurt"
            gap_mm = now.hazards_mm.get(name, math.inf)
            near = min(max(1.0 - gap_mm / task.margin_mm, 0.0), 1.0)
            if elapsed_s <= ABSENT_S:
                # the trapezoid: not dependent on how often samples come
                doses[name] += 0.5 * (near + nearness[name]) * elapsed_s
            nearness[name] = near
            if doses[name] > task.most_dose_s:
                self.failed = self.failed or f"too long too near to {name}"
        self._doses_s, self._nearness = doses, nearness
        worst = max(doses.values(), default=0.0)
        most = task.most_dose_s
        self.progress = max(1.0 - worst / most, 0.0) if most > 0.0 else 1.0


class _Survey(Rule):
    def __init__(self, task: tasks.Survey) -> None:
        super().__init__()
        self._sites = task.sites

    def step(self, now: Situation, elapsed_s: float) -> None:
        shares = [
            min(now.seen_percent.get(name, 0.0) / percent, 1.0)
            for name, percent in self._sites.items()
        ]
        self.progress = float(np.mean(shares))


def rule_of(task: tasks.Task, places: Places, head: Head | None = None) -> Rule:
    """Return the rule of a task.

    places: ``(3,)`` LPS mm of landmarks, by name. head: before anybody operated; None
    for the one of the first situation, which has no parts.
    """
    match task:
        case tasks.Reach():
            return _Reach(task, places)
        case tasks.LookTask():
            return _Look(task, places)
        case tasks.Hold():
            return _Hold(task, places)
        case tasks.Follow():
            return _Follow(task, places)
        case tasks.Inject():
            return _Inject(task, places)
        case tasks.Remove():
            return _Remove(task, head)
        case tasks.Open():
            return _Open(task, places, head)
        case tasks.KeepAway():
            return _KeepAway(task)
        case tasks.Survey():
            return _Survey(task)


def is_in_sight(
    distance: Volume, eye: NDArray[np.float64], place: NDArray[np.float64]
) -> bool:
    """Return whether the way from an eye to a place on the mucosa is free.

    distance: signed air distance, mm, negative in air. eye, place: ``(3,)`` LPS mm.
    """
    near_mm = max(NEAR_TARGET_MM, WITHIN * float(distance.sample(place)))
    length = _apart(eye, place) - near_mm
    if length <= 0.0:
        return True
    count = math.ceil(length / SIGHT_STEP_MM) + 1
    along = np.linspace(0.0, length / (length + near_mm), count)
    return bool(distance.sample(eye + along[:, None] * (place - eye)).max() < 0.0)


def _is_level(frame: NDArray[np.float64], level_deg: float) -> bool:
    """Return whether a picture is turned from upright by so much at most.

    frame: of its camera. Straight up or down no picture is level.
    """
    across, upwards = float(frame[1] @ SUPERIOR), float(frame[2] @ SUPERIOR)
    if math.hypot(across, upwards) < LEAST_GRAVITY:
        return False
    return abs(math.degrees(math.atan2(across, upwards))) <= level_deg


def _at(place: tasks.Place, places: Places) -> NDArray[np.float64]:
    return places[place] if isinstance(place, str) else np.array(place)


def _tip(now: Situation, held: tasks.Held) -> NDArray[np.float64] | None:
    return now.tip_mm if held is tasks.Held.SCOPE else now.tool_tip_mm


def _apart(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(a - b))
