"""Where the open task's place lies in the picture, and the way there."""

import math
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from paravol.guide.air_way import (
    AirWay,
    back_to_turn_mm,
    farthest_seen,
    first_of,
    length_mm,
)
from paravol.guide.goals import (
    Goal,
    GuidedHead,
    goal_of,
    open_task,
    wanted_parts,
)
from paravol.guide.scope_place import ScopePlaces, ScopePose
from renderers.scene import Camera
from scenarios import FrameState
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments.catalogue import Action, instrument_named
from scenarios.instruments.contact_shape import works_at_mm
from scenarios.tasks import Task, TaskState
from scenarios.tasks import task as tasks
from scenarios.tasks.rules import is_in_sight

_Doubles = NDArray[np.float64]

RENEWED_S = 1.5
"""Where the goal changes by what is done, it is looked for so often."""

NEXT_S = 0.1
"""So long the next point of the way stays where it is."""

AHEAD_MM = 20.0
"""The next point of the way is so far ahead at most: who is near sees how to tilt."""

AT_HAND_MM = 8.0
"""A place that a tool works at is shown from so near, even behind what it works at."""

SCOPE_MOVED_MM = 2.0
"""A scope that has gone so far leaves a tool other ways."""

LAYS_S = 3.0
"""So long a scope may be on its way to where it is laid."""

RETRIED_MM = 6.0
"""Where there was no way, it is looked for again once the tip has gone so far."""


@dataclass(frozen=True, slots=True)
class GuideMark:
    """Where to go, as it lies over the picture.

    what: the place's name. place_mm: ``(3,)`` of it, LPS. way_mm: how far it is, along
    the way. x, y: shares of the picture, (0, 0) in its upper left corner, of the goal
    or of the next point on the way there; out of the round picture only their direction
    from the middle counts. is_goal: it is the goal itself, with nothing in between.
    progress: of the task, 0 to 1. back_mm: so far the scope must be drawn back first:
    its shaft, straight from the nostril, does not turn there where it is. is_reached:
    see `Goal`.
    """

    what: str
    place_mm: _Doubles
    way_mm: float
    x: float
    y: float
    is_goal: bool
    progress: float = 0.0
    back_mm: float = 0.0
    is_reached: bool = True

    @property
    def is_in_picture(self) -> bool:
        """Return whether it lies in the round picture."""
        return math.hypot(self.x - 0.5, self.y - 0.5) <= 0.5

    def text(self) -> str:
        """Return the distance in words, and what one must do first."""
        if not self.is_reached:
            return f"{self.way_mm:.0f} mm · no way for the tool: move the scope"
        if self.back_mm > 0.0:
            return f"{self.way_mm:.0f} mm · draw back {self.back_mm:.0f} mm first"
        return f"{self.way_mm:.0f} mm"


@dataclass(frozen=True, slots=True)
class _Ask:
    """What somebody who finds a goal must know; key: of the same goal."""

    key: tuple[object, ...]
    task: Task
    state: TaskState
    tip_mm: _Doubles
    eye_mm: _Doubles
    cuts: int
    view: FrameState


@dataclass(frozen=True, slots=True)
class _Found:
    """What was found for an `_Ask`; way: None while there is none.

    is_ahead: it is for where the scope is going.
    """

    ask: _Ask
    at_s: float
    goal: Goal | None
    way: AirWay | None = None
    has_sought: bool = False
    is_ahead: bool = False


@dataclass(frozen=True, slots=True)
class _Next:
    """Where to go next, for `NEXT_S`: see `GuideMark`."""

    at_s: float
    found: _Found
    aim_mm: _Doubles
    way_mm: float
    back_mm: float
    is_goal: bool


Laid = Callable[[ScopePose | None, float, str], object]
"""Hears where a scope is to lie, and how deep it is turned, mm; None where the tool in
hand gets to its place from nowhere, and the name of one that does, "" for none."""


class _OvertakenError(Exception):
    """Another way is wanted by now."""


class Guide:
    """Find goals and ways in a thread of its own, and lay them over pictures.

    is_on: somebody wants to see it.
    """

    def __init__(self, every: Sequence[Task]) -> None:
        """Begin without a head; every: the exercise's tasks."""
        self.is_on = True
        self._tasks = tuple(every)
        self._head: GuidedHead | None = None
        self._scopes: ScopePlaces | None = None
        self._wanted: _Ask | None = None
        self._to_lay: tuple[_Ask, Sequence[str], Laid] | None = None
        self._laid: list[_Doubles] = []
        self._laid_for: tuple[object, ...] = ()
        self._found: _Found | None = None
        self._next: _Next | None = None
        self._is_closed = False
        self._wakes = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="guide", daemon=True)

    def take_head(self, head: GuidedHead, scopes: ScopePlaces | None = None) -> None:
        """Begin to find ways through a head; it may be cut meanwhile.

        scopes: finds where a scope may lie; None where nobody lays it.
        """
        self._head, self._scopes = head, scopes
        if self._tasks and self._thread.ident is None:
            self._thread.start()

    def close(self) -> None:
        """End the thread, soon; nobody hears of anything from now on."""
        with self._wakes:
            self._is_closed = True
            self._wakes.notify()

    def mark(
        self, view: FrameState, states: Sequence[TaskState], cuts: int
    ) -> GuideMark | None:
        """Return what to show over a view; None for nothing.

        states: of the tasks. cuts: counts them, and their undoing.
        """
        head = self._head
        opened = open_task(self._tasks, states) if states and self.is_on else None
        if head is None or opened is None:
            return None
        task, state = opened
        tip = _tip(task, view)
        # a ring that was passed makes another goal
        passed = round(state.progress * 1e6) if isinstance(task, tasks.Follow) else 0
        eye = np.array(view.camera.eye_mm)
        ask = _Ask((task.name, passed), task, state, tip, eye, cuts, view)
        found = self._found
        self._ask(ask, found)
        if found is None or found.ask.key != ask.key or found.goal is None:
            return None
        now_s, step = time.monotonic(), self._next
        if step is None or step.found is not found or now_s > step.at_s + NEXT_S:
            step = self._next = _step(now_s, found, found.goal, view, head, tip)
        x, y = _over(view.camera, step.aim_mm)
        goal = found.goal
        return GuideMark(
            goal.what,
            goal.place_mm,
            step.way_mm,
            x,
            y,
            step.is_goal,
            state.progress,
            step.back_mm,
            goal.is_reached,
        )

    def lay_scope(
        self,
        view: FrameState,
        states: Sequence[TaskState],
        cuts: int,
        tools: Sequence[str],
        heard: Laid,
    ) -> bool:
        """Find where the scope is to lie, so that the tool in hand gets to its place.

        Asked again for the same it is another place. tools: that may be used. heard:
        is called once that is known, by another thread. Return whether there is
        anything to be found.
        """
        opened = open_task(self._tasks, states) if states else None
        if opened is None or self._scopes is None or view.instrument == NO_TOOL:
            return False
        task, state = opened
        if not isinstance(task, tasks.Inject | tasks.Remove | tasks.Open):
            return False
        tip, eye = view.world_from_tip[:3, 3], np.array(view.camera.eye_mm)
        ask = _Ask((task.name, 0), task, state, tip, eye, cuts, view)
        with self._wakes:
            self._to_lay = ask, tools, heard
            self._wakes.notify()
        return True

    def look_anew(self) -> None:
        """Look for the goal from where the scope lies now: it was laid."""
        found = self._found
        if found is not None and found.is_ahead:
            self._found = replace(found, at_s=-math.inf)

    def _ask(self, ask: _Ask, found: _Found | None) -> None:
        """Let a goal be found, unless it is known or somebody is at it."""
        if found is not None and found.ask.key == ask.key:
            age_s = time.monotonic() - found.at_s
            is_cut = found.ask.cuts != ask.cuts
            changes = isinstance(ask.task, tasks.Survey | tasks.Follow)
            changes |= found.is_ahead
            moved_mm = float(np.linalg.norm(found.ask.tip_mm - ask.tip_mm))
            has_none = found.way is None or isinstance(ask.task, tasks.Remove)
            is_lost = found.has_sought and has_none and moved_mm > RETRIED_MM
            before = found.ask.view
            is_cutting = isinstance(ask.task, tasks.Remove | tasks.Open)
            if is_cutting and ask.view.instrument != NO_TOOL:
                # elsewhere the tool in hand, or another, gets to other places
                away = before.world_from_tip[:3, 3] - ask.view.world_from_tip[:3, 3]
                changes |= before.instrument != ask.view.instrument
                changes |= float(np.linalg.norm(away)) > SCOPE_MOVED_MM
                is_lost = False
            if age_s < RENEWED_S or not (is_cut or changes or is_lost):
                return
        with self._wakes:
            if self._wanted is None or self._wanted.key != ask.key:
                self._wanted = ask
                self._wakes.notify()

    def _run(self) -> None:
        assert self._head is not None
        for task in self._tasks:
            if isinstance(task, tasks.Remove):
                # before anything is cut
                wanted_parts(task, self._head)
        while True:
            with self._wakes:
                while not (self._wanted or self._to_lay or self._is_closed):
                    self._wakes.wait()
                if self._is_closed:
                    return
                to_lay, self._to_lay = self._to_lay, None
                ask, self._wanted = self._wanted, None
            if to_lay is not None:
                self._lay(*to_lay, self._head)
            if ask is None:
                continue
            try:
                self._find(ask, self._head)
            except _OvertakenError:
                continue

    def _lay(
        self, ask: _Ask, tools: Sequence[str], told: Laid, head: GuidedHead
    ) -> None:
        def heard(pose: ScopePose | None, drawn_mm: float, other: str) -> None:
            with self._wakes:
                if not self._is_closed:
                    told(pose, drawn_mm, other)

        scopes, now = self._scopes, ask.view.world_from_tip
        assert scopes is not None
        same = ask.task.name, ask.view.instrument, ask.cuts
        if self._laid_for != same:
            self._laid, self._laid_for = [], same
        pose = scopes.for_tool(ask.task, ask.state, head, ask.view, self._laid)
        if pose is None and self._laid:
            # from each of them once more
            self._laid = []
            pose = scopes.for_tool(ask.task, ask.state, head, ask.view)
        if pose is None:
            for other in _cutting(ask.task, tools):
                view = replace(ask.view, instrument=other)
                if scopes.for_tool(ask.task, ask.state, head, view) is not None:
                    heard(None, 0.0, other)
                    return
            heard(None, 0.0, "")
            return
        self._laid.append(pose.frame[:3, 3])
        if pose.seen is not None:
            # what is found there counts until the scope lies there
            at_s = time.monotonic() + LAYS_S
            self._found = _Found(
                replace(ask, view=pose.seen), at_s, pose.goal, is_ahead=True
            )
        heard(pose, scopes.drawn_mm(now, pose), "")

    def _find(self, ask: _Ask, head: GuidedHead) -> None:
        before = self._found
        if before is not None and before.goal is not None:
            is_same = before.ask.view.instrument == ask.view.instrument
            if is_same and before.ask.key == ask.key:
                # who is on the way there is not sent elsewhere for a little more
                head = replace(head, kept_mm=before.goal.place_mm)
        goal = goal_of(ask.task, ask.state, head, ask.tip_mm, ask.eye_mm, ask.view)
        found = _Found(ask, time.monotonic(), goal)
        if before is not None and before.goal is not None and goal is not None:
            is_same = bool((before.goal.place_mm == goal.place_mm).all())
            is_same &= before.goal.is_reached == goal.is_reached
            if is_same and before.ask.cuts == ask.cuts and before.way is not None:
                self._found = replace(found, way=before.way, has_sought=True)
                return
            if before.ask.key == ask.key:
                # the way before is better than none meanwhile
                found = replace(found, way=before.way)
        self._found = found
        if goal is None:
            return

        def still() -> None:
            wanted = self._wanted
            if self._is_closed or (wanted is not None and wanted.key != ask.key):
                raise _OvertakenError

        way = None
        with suppress(ValueError):
            way = AirWay(head.distance, ask.tip_mm, goal.place_mm, still)
        self._found = replace(found, at_s=time.monotonic(), way=way, has_sought=True)


def _cutting(task: Task, tools: Sequence[str]) -> list[str]:
    """Return the tools with which a task may be done, those that bite first.

    What scrapes takes too little.
    """
    if isinstance(task, tasks.Inject):
        return []
    actions = {name: instrument_named(name).action for name in tools}
    takes = [Action.BITE, Action.POWERED, Action.CUT]
    return [name for way in takes for name in tools if actions[name] is way]


def _step(
    now_s: float,
    found: _Found,
    goal: Goal,
    view: FrameState,
    head: GuidedHead,
    tip: _Doubles,
) -> _Next:
    """Find where to go next: the goal itself where it is in sight, else the way."""
    eye, place, task = view.camera.frame[0], goal.place_mm, found.ask.task
    is_goal = is_in_sight(head.distance, eye, place)
    if isinstance(task, tasks.LookTask) and found.way is not None:
        # what is seen from too far away is gone to
        is_goal &= float(np.linalg.norm(place - eye)) <= task.farthest_mm
    aim, way_mm = place, float(np.linalg.norm(place - tip))
    if isinstance(task, tasks.Inject | tasks.Remove | tasks.Open):
        # tissue before it hides no place from a tool that is there
        is_goal |= float(np.linalg.norm(place - tip)) <= AT_HAND_MM
    chain = None
    if not is_goal and found.way is not None:
        chain = found.way.chain(tip)
    if chain is not None:
        way_mm = length_mm(chain)
        _, aim = farthest_seen(head.distance, eye, first_of(chain, AHEAD_MM))
    back_mm = 0.0
    goes_there = isinstance(task, tasks.Reach | tasks.Hold | tasks.Follow)
    # where it is enough to see the place, the scope stays where it sees it
    if goes_there or not is_goal:
        shaft_tip, back = view.world_from_tip[:3, 3], view.world_from_tip[:3, 2]
        # it may lean to any side of the nostril
        pivot = shaft_tip + float((head.nostril_mm - shaft_tip) @ back) * back
        back_mm = back_to_turn_mm(head.distance, pivot, shaft_tip, aim)
    return _Next(now_s, found, aim, way_mm, back_mm, is_goal)


def _tip(task: Task, view: FrameState) -> _Doubles:
    """Return the tip that a task is about, as far as there is one."""
    held = getattr(task, "held", None)
    is_tools = held is tasks.Held.TOOL or isinstance(
        task, tasks.Inject | tasks.Remove | tasks.Open
    )
    tool = view.world_from_instrument
    if is_tools and view.instrument != NO_TOOL and np.isfinite(tool).all():
        # what bites beside its tip comes there with its side
        works: _Doubles = tool[:3, :3] @ works_at_mm(view.instrument) + tool[:3, 3]
        return works
    return np.array(view.world_from_tip[:3, 3])


def _over(camera: Camera, place_mm: _Doubles) -> tuple[float, float]:
    """Return where a place lies over a picture, out of it where it is not seen."""
    (column, row), _ = camera.project(place_mm)
    x, y = float(column) / camera.width, float(row) / camera.height
    if math.isfinite(x) and math.isfinite(y):
        return x, y
    local = camera.frame[1:3] @ (place_mm - camera.frame[0])
    length = max(float(np.linalg.norm(local)), 1e-9)
    return 0.5 + float(local[0]) / length, 0.5 - float(local[1]) / length
