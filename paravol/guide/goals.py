"""Where the place of an open task is, by its kind and by how far it is done."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from anatomy.tissue import Label
from paravol.guide.bite_place import AS_GOOD, GRIPPED, BitePlace, bite_place
from paravol.inputs.asked_tissue import around_way
from paravol.inputs.tool_plan import ToolPlan
from renderers.scene import Camera, Volume
from scenarios import FrameState
from scenarios.coverage import CoverageWatch
from scenarios.instrument_state import NO_TOOL
from scenarios.structures import Structures
from scenarios.tasks import Status, Task, TaskState
from scenarios.tasks import task as tasks
from scenarios.tasks.head_parts import Head, HeadPart
from scenarios.tasks.rules import SIGHT_STEP_MM, is_in_sight

_Doubles = NDArray[np.float64]

BEFORE_MM, BEYOND_MM = 7.0, 1.5
"""A ring is aimed at from so far before it, and passed by so much."""

INSIDE, WIDENS = 0.6, 1.0
"""A ring is passed straight on from a cone before it: so wide in it, in shares of its
radius, and so much wider for each mm before it."""

FACING, ASKEW_MM = 0.4, 25.0
"""Cosine to a wall's normal from which mucosa is well seen; what lies more askew is
gone to as if it lay so much farther away."""

ENOUGH, STEP_MM = 0.8, 0.6
"""A needle is led to so much of the radius and the depth that count, at most; places
for it are so far apart."""

WELL_INSIDE = 0.85
"""Tools are sent to what lies no farther off the picture's middle, 1 at its rim."""

LOOKED_AT = 60
"""Places of tissue that are tried for sight, at most, the nearest first."""


@dataclass(frozen=True, slots=True)
class Goal:
    """The place of a task: what it is called, and where, ``(3,)`` LPS mm.

    worth: what the tool in hand is worth there, see `ToolPlan.worth`; infinite where
    nobody knows.
    """

    what: str
    place_mm: _Doubles
    worth: float = math.inf

    @property
    def is_reached(self) -> bool:
        """Return whether the tool in hand can work there, as far as somebody knows."""
        return self.worth > 0.0


@dataclass(frozen=True, slots=True)
class GuidedHead:
    """What of a head tells where goals are.

    distance: signed air distance as the head is cut, mm, negative in air. landmarks:
    ``(3,)`` LPS mm by name. structures: None where nothing is named. coverage: what was
    seen so far; None where nobody watches. nostril_mm: where the scope goes in. parts:
    those that were asked for so far, by name. plan: tells where tools get to; None
    where nobody knows. scope_mm: radius of the scope. gripped: places at which a tool
    in hand is tried, at most. kept_mm: where a tool was sent before, ``(3,)``.
    """

    distance: Volume
    landmarks: Mapping[str, _Doubles]
    structures: Structures | None
    coverage: CoverageWatch | None
    nostril_mm: _Doubles
    hazards: HazardVolumes | None = None
    spared: tuple[str, ...] = ()
    plan: ToolPlan | None = None
    scope_mm: float = 2.0
    gripped: int = GRIPPED
    kept_mm: _Doubles | None = None
    parts: dict[str, HeadPart | None] = field(default_factory=dict, compare=False)


@dataclass(frozen=True, slots=True)
class _Seeker:
    """Who goes to a place: see `goal_of`."""

    head: GuidedHead
    tip_mm: _Doubles
    eye_mm: _Doubles
    view: FrameState | None

    def grip(self) -> Callable[[_Doubles], _Doubles] | None:
        """Return what the tool in hand is worth at places; None without a tool."""
        head, view, eye_mm = self.head, self.view, self.eye_mm
        plan = head.plan
        if plan is None or view is None or view.instrument == NO_TOOL:
            return None
        held, scope, camera = view.instrument, view.world_from_tip, view.camera

        def worth(some: _Doubles) -> _Doubles:
            found = np.zeros(len(some))
            away = np.array([_off_middle(camera, place) for place in some])
            is_in, up = away < WELL_INSIDE, camera.frame[2]
            found[is_in] = plan.worth(
                held, some[is_in], scope, head.scope_mm, up, eye_mm
            )
            return found

        return worth

    def bite(self, places: _Doubles) -> BitePlace | None:
        """Return where of some places to bite next; see `bite_place`."""
        head = self.head
        assert head.structures is not None
        return bite_place(
            head.distance,
            head.structures.labels,
            places,
            self.tip_mm,
            self.eye_mm,
            head.nostril_mm,
            head.spared,
            head.hazards,
            self.grip(),
            head.gripped,
            head.kept_mm,
        )

    def nearest_seen(self, places: _Doubles) -> _Doubles:
        """Return of places ``(n, 3)`` the nearest that the eye sees, or any."""
        order = np.argsort(np.linalg.norm(places - self.tip_mm, axis=1))
        for number in order[:: max(len(order) // LOOKED_AT, 1)]:
            if is_in_sight(self.head.distance, self.eye_mm, places[number]):
                seen: _Doubles = places[number]
                return seen
        nearest: _Doubles = places[order[0]]
        return nearest


def open_task(
    every: Sequence[Task], states: Sequence[TaskState]
) -> tuple[Task, TaskState] | None:
    """Return the task that is to be done now: the first open one that has an end."""
    for task, state in zip(every, states, strict=True):
        only_spares = isinstance(task, tasks.Remove) and not task.asks
        if isinstance(task, tasks.KeepAway) or only_spares:
            continue
        if state.status is Status.OPEN:
            return task, state
    return None


def goal_of(
    task: Task,
    state: TaskState,
    head: GuidedHead,
    tip_mm: _Doubles,
    eye_mm: _Doubles | None = None,
    view: FrameState | None = None,
) -> Goal | None:
    """Return where to go for a task; None where nobody knows.

    tip_mm: ``(3,)`` LPS of what goes there: of places that are as good, the nearest is
    taken. eye_mm: ``(3,)`` of the lens; tissue that it sees goes before the rest. view:
    tells which tool is in hand: it is sent where it can work.
    """
    seeker = _Seeker(head, tip_mm, tip_mm if eye_mm is None else eye_mm, view)
    match task:
        case tasks.Follow():
            return _ring(task, state, head, tip_mm)
        case tasks.Remove():
            return _left(task, seeker)
        case tasks.Open():
            return _narrowest(task, seeker)
        case tasks.Survey():
            return _unseen(task, head, tip_mm)
        case tasks.KeepAway():
            return None
        case tasks.Inject():
            place, worth = _injected(task, seeker)
            return Goal(_name(task.place, task.name), place, worth)
        case _:
            return Goal(_name(task.place, task.name), _at(task.place, head))


def tool_places(task: Task, head: GuidedHead) -> _Doubles:
    """Return places ``(n, 3)`` of tissue at which a task is done with a tool."""
    match task:
        case tasks.Inject():
            return _injectable(task, head)
        case tasks.Remove(parts=parts) if parts and head.structures is not None:
            known = Head(head.distance, head.structures)
            found = [known.places(p.voxels) for p in wanted_parts(task, head).values()]
            return np.vstack([np.zeros((0, 3)), *found])
        case tasks.Remove() if head.structures is not None:
            return _wanted_tissue(task, head, head.structures)
        case tasks.Open():
            return around_way(task, _at(task.start, head), _at(task.end, head))
    return np.zeros((0, 3))


def _ring(
    task: tasks.Follow, state: TaskState, head: GuidedHead, tip_mm: _Doubles
) -> Goal:
    passed = min(round(state.progress * len(task.rings)), len(task.rings) - 1)
    ring = task.rings[passed]
    middle, axis = _at(ring.place, head), np.array(ring.axis)
    away = tip_mm - middle
    before_mm = float(away @ axis)
    aside_mm = float(np.linalg.norm(away - before_mm * axis))
    name = _name(ring.place, f"ring {passed + 1}")
    # from behind it one goes back first, and so does who is beside its wire
    if before_mm < 0.0 and aside_mm < INSIDE * ring.radius_mm - WIDENS * before_mm:
        return Goal(name, middle + BEYOND_MM * axis)
    return Goal(f"back before {name}", middle - BEFORE_MM * axis)


def _left(task: tasks.Remove, seeker: _Seeker) -> Goal | None:
    """Return where of the tissue that is to be taken to bite next."""
    head = seeker.head
    if head.structures is None:
        return None
    if task.parts:
        return _left_of_parts(task, seeker)
    places = _wanted_tissue(task, head, head.structures)
    best = seeker.bite(places) if len(places) else None
    if best is None:
        return None
    return Goal(" and ".join(_wanted_names(task)), best.place_mm, best.worth)


def _wanted_names(task: tasks.Remove) -> list[str]:
    return [name for name, limit in task.tissues.items() if limit.least_mm3 > 0.0]


def _wanted_tissue(
    task: tasks.Remove, head: GuidedHead, structures: Structures
) -> _Doubles:
    """Return where tissue is that is to be taken, ``(n, 3)``, on the scope's side."""
    known = {label.name.lower().replace("_", " "): label.value for label in Label}
    numbers = [known[name] for name in _wanted_names(task) if name in known]
    labels = structures.labels
    k, j, i = np.nonzero(np.isin(labels.values, numbers))
    matrix = labels.world_from_voxel
    places = np.stack([i, j, k], axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
    others = [p for n, p in head.landmarks.items() if n.startswith("nostril, ")]
    own = np.linalg.norm(places - head.nostril_mm, axis=1)
    for other in others:
        # of both sides' the one that the scope is in
        keep = own <= np.linalg.norm(places - other, axis=1) + 2.0
        places, own = places[keep], own[keep]
    return places


def _off_middle(camera: Camera, place_mm: _Doubles) -> float:
    """Return how far off a picture's middle a place lies; 1 at its rim."""
    (column, row), _ = camera.project(place_mm)
    x, y = 2.0 * column / camera.width - 1.0, 2.0 * row / camera.height - 1.0
    away = math.hypot(float(x), float(y))
    return away if math.isfinite(away) else math.inf


def _left_of_parts(task: tasks.Remove, seeker: _Seeker) -> Goal | None:
    """Return where to bite of a task's parts: of what is seen, the nearest part."""
    head = seeker.head
    known = Head(head.distance, head.structures)
    goals: list[tuple[bool, Goal]] = []
    for name, part in wanted_parts(task, head).items():
        best = seeker.bite(known.places(part.voxels))
        if best is not None:
            goal = Goal(name, best.place_mm, best.worth)
            goals.append((not best.is_seen, goal))
    if not goals:
        return None
    at_mm = seeker.tip_mm
    return min(goals, key=lambda found: (found[0], _away_mm(found[1], at_mm)))[1]


def wanted_parts(task: tasks.Remove, head: GuidedHead) -> dict[str, HeadPart]:
    """Return the parts that are to be taken, by name.

    They are known from the first time on: of a head that was cut they would be others.
    """
    known = Head(head.distance, head.structures)
    found = {}
    for name, share in task.parts.items():
        if name not in head.parts:
            head.parts[name] = known.part(name)
        part = head.parts[name]
        if part is not None and share.least_percent > 0.0:
            found[name] = part
    return found


def _away_mm(goal: Goal, place_mm: _Doubles) -> float:
    return float(np.linalg.norm(goal.place_mm - place_mm))


def _injected(task: tasks.Inject, seeker: _Seeker) -> tuple[_Doubles, float]:
    """Return where a needle may go in: of what is near enough what it gets to.

    Else the nearest in sight. And what it is worth there.
    """
    head, tip_mm, eye_mm = seeker.head, seeker.tip_mm, seeker.eye_mm
    places = _injectable(task, head)
    if not len(places):
        return _at(task.place, head), math.inf
    grip = seeker.grip()
    if grip is not None:
        some = places[:: max(len(places) // (8 * head.gripped), 1)]
        seen = [p for p in some if is_in_sight(head.distance, eye_mm, p)]
        seen = seen[:: max(len(seen) // head.gripped, 1)]
        worths = grip(np.array(seen).reshape(-1, 3))
        if len(seen) and worths.max() > 0.0:
            good = np.array(seen)[worths > AS_GOOD * worths.max()]
            away = np.linalg.norm(good - tip_mm, axis=1)
            return good[int(np.argmin(away))], float(worths.max())
    return seeker.nearest_seen(places), math.inf if grip is None else 0.0


def _injectable(task: tasks.Inject, head: GuidedHead) -> _Doubles:
    """Return where a needle may go in, ``(n, 3)``."""
    place, reach_mm = _at(task.place, head), ENOUGH * task.radius_mm
    steps = np.arange(-reach_mm, reach_mm + STEP_MM, STEP_MM)
    off = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    places = place + off[np.linalg.norm(off, axis=1) <= reach_mm]
    deep = head.distance.sample(places)
    found: _Doubles = places[(deep > 0.0) & (deep < ENOUGH * task.deepest_mm)]
    return found


def _narrowest(task: tasks.Open, seeker: _Seeker) -> Goal:
    """Return where to widen a neck: with a tool in hand what it can bite there."""
    head, view = seeker.head, seeker.view
    start, end = _at(task.start, head), _at(task.end, head)
    name = _name(task.end, task.name)
    if head.structures is not None and view is not None and view.instrument != NO_TOOL:
        best = seeker.bite(around_way(task, start, end))
        if best is not None:
            return Goal(name, best.place_mm, best.worth)
    count = max(int(np.linalg.norm(end - start) / SIGHT_STEP_MM), 1) + 1
    way = np.linspace(start, end, count)
    return Goal(name, way[np.argmax(head.distance.sample(way))])


def _unseen(task: tasks.Survey, head: GuidedHead, tip_mm: _Doubles) -> Goal | None:
    """Return the nearest mucosa of the site of which the least was seen."""
    watch = head.coverage
    if watch is None:
        return None
    shares = {
        name: watch.percent(name) / percent for name, percent in task.sites.items()
    }
    name = min(shares, key=lambda each: shares[each])
    mucosa = watch.mucosa
    chosen = np.isin(mucosa.site, mucosa.members[name]) & ~watch.seen
    if not chosen.any():
        return None
    normals = mucosa.normals[chosen]
    places = mucosa.places[chosen] + 0.5 * normals
    ways = tip_mm - places
    away = np.linalg.norm(ways, axis=1)
    # what turns its edge to the scope counts only from elsewhere
    is_askew = np.einsum("nc,nc->n", ways, normals) < FACING * away
    return Goal(f"{name}, unseen", places[np.argmin(away + ASKEW_MM * is_askew)])


def _at(place: tasks.Place, head: GuidedHead) -> _Doubles:
    return head.landmarks[place] if isinstance(place, str) else np.array(place)


def _name(place: tasks.Place, otherwise: str) -> str:
    # what scenes call a target is a sign for who reads it
    return place.replace("target", "sign") if isinstance(place, str) else otherwise
