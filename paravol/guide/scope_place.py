"""Where an assistant lays the scope, so that a place is seen and a tool gets there."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from devices.controls.fulcrum import Fulcrum
from paravol.guide.goals import Goal, GuidedHead, goal_of, tool_places
from paravol.inputs.nostril_lines import LEAN_MM, RINGS, NostrilLines
from paravol.inputs.pointed_tool import thickness_mm
from paravol.inputs.tool_hold import BESIDE_MM
from paravol.inputs.tool_plan import ToolPlan, tip_frames
from renderers.scene import Volume
from scenarios import Endoscope, FrameState
from scenarios.instrument_state import NO_TOOL
from scenarios.tasks import Task, TaskState

_Doubles = NDArray[np.float64]

NEAR_MM, FAR_MM = 8.0, 20.0
"""From the lens to what is operated; nearer the scope leaves a tool no room."""

STEP_MM, APART_MM = 2.5, 3.0
"""Between places where a lens may lie; nearer than the second they see the same."""

ROUND, WITHIN = 12, 0.75
"""Turns of the light post that are compared, and how far off the picture's middle a
place counts as seen, 1 at its rim."""

ROOM_MM, DENT_MM, TURNED_MM = 0.6, 0.4, 1.0
"""More air than this about a scope is not better; so deep it may press into mucosa, and
while it is turned: deeper walls would push it elsewhere."""

END_RADII = np.array([1.0, 1.8])[:, None]
"""Where the end of a scope is looked at, in its radii behind the tip."""

CLEAR_MM, CLEAR = 0.6, 1.0
"""What a pose loses for each mm that it is nearer to what must not be hurt."""

SIGHT, SIGHT_MM = 15, 1.5
"""Places on the way from the lens that must be free, but the last so near the place."""

EVEN, ASIDE = 0.02, 0.3
"""What a pose loses for each mm off the nostril's middle, and for each mm that the
shaft is dented more on average."""

SEES, SEEN = 1.0, 0.5
"""What a pose gains by e times as much that it sees; and what that counts which another
pose has seen."""

DRAWN_MM = 0.0, 4.0, 8.0, 13.0, 20.0, 30.0, 40.0
"""So far a scope is drawn back to be turned, as little as will do."""

BETWEEN = 6
"""Poses on the way from one to another that are looked at."""

TRIED, IN_VAIN, GOOD = 6, 14, 25.0
"""Poses for which a tool's ways are looked at, at most; and where it was worth nothing
from any of them. None after one at which it is worth so much."""

GRIPPED = 12
"""Places at which it is tried from each, at most."""

BESIDES = 5
"""Places of a scope's end that are kept off a tool's line."""

PLACES, SKIN_MM = 50, 1.2
"""Places of tissue that are to be seen, at most; they lie so deep in it at most."""


class ScopePose(NamedTuple):
    """How a scope lies: its tip's frame, 4x4, its y axis at the light post.

    entry_mm: ``(3,)`` where it passes the nostril. roll_deg: of the light post. seen,
    goal: the view from there, and where the tool in hand works best in it.
    """

    frame: _Doubles
    entry_mm: _Doubles
    roll_deg: float
    seen: FrameState | None = None
    goal: Goal | None = None


class ScopePlaces:
    """Find poses of a scope in a nostril."""

    def __init__(
        self,
        fulcrum: Fulcrum,
        distance: Volume,
        endoscope: Endoscope,
        cone_deg: float,
        hazards: HazardVolumes | None = None,
    ) -> None:
        """Take the nostril, and signed air distance, mm, read as it is at the time.

        cone_deg: greatest tilt of a shaft from the nostril's axis. hazards: must not be
        hurt.
        """
        self._fulcrum, self._distance = fulcrum, distance
        self._endoscope = endoscope
        self._least = math.cos(math.radians(cone_deg))
        self._hazards = hazards.nearest if hazards and hazards.names else None
        self._radius_mm = endoscope.diameter_mm / 2
        self._lines = NostrilLines(fulcrum, distance, LEAN_MM, RINGS)

    def for_tool(
        self,
        task: Task,
        state: TaskState,
        head: GuidedHead,
        view: FrameState,
        left_out: Sequence[_Doubles] = (),
    ) -> ScopePose | None:
        """Return the pose from which the tool in hand does most of what a task asks.

        None where it does nothing from any. view: as it is now. left_out: tips,
        ``(3,)``, that lead nowhere.
        """
        endoscope = self._endoscope.at(view.scope_deg)
        head = replace(head, gripped=GRIPPED)
        places = tool_places(task, head)
        deep = self._distance.nearest(places)
        places = places[(deep > 0.0) & (deep < SKIN_MM)]
        places = places[:: max(len(places) // PLACES, 1)]
        best, most = None, 0.0
        size = view.camera.width, view.camera.height
        room = None
        if head.plan is not None and view.instrument != NO_TOOL:
            room = self._room(head.plan, view.instrument, places)
        poses = self.looking_at(places, endoscope, left_out, room)
        for number, pose in enumerate(islice(poses, IN_VAIN)):
            if number >= TRIED and best is not None:
                break
            camera = endoscope.camera(pose.frame, pose.roll_deg, size)
            seen = replace(view, camera=camera, world_from_tip=pose.frame)
            tip = pose.frame[:3, 3]
            found = goal_of(task, state, head, tip, camera.eye_mm, seen)
            if found is not None and found.worth > most:
                most = found.worth
                best = pose._replace(seen=seen, goal=found)
            if most > GOOD:
                break
        return best

    def looking_at(
        self,
        places: _Doubles,
        endoscope: Endoscope,
        left_out: Sequence[_Doubles] = (),
        room: Callable[[_Doubles, _Doubles], _Doubles] | None = None,
    ) -> Iterator[ScopePose]:
        """Give poses that see places, ``(n, 3)``, best first, each lying elsewhere.

        What one has seen counts less for the next. None dents walls deeper than
        `DENT_MM`. left_out: tips, ``(3,)``, near which none lies. room: tells what a
        tool is worth at the places, ``(m, n)``, beside scopes with tips and entries
        ``(m, 3)``; None where any place counts.
        """
        if not len(places):
            return
        tips, entries, worth = self._lying(places)
        frames, sees = self._sees(tips, entries, places, endoscope)
        counts = np.float32(1.0) if room is None else room(tips, entries)
        shown = (sees * counts).astype(np.float32)
        for tip in left_out:
            worth[np.linalg.norm(tips - tip, axis=1) < APART_MM] = -math.inf
        fresh = np.ones(len(places), np.float32)
        while len(tips):
            with np.errstate(divide="ignore"):
                total = worth + SEES * np.log(shown @ fresh)
            turn, number = np.unravel_index(int(np.argmax(total)), total.shape)
            if not np.isfinite(total[turn, number]):
                return
            roll_deg = math.remainder(int(turn) * 360.0 / ROUND, 360.0)
            yield ScopePose(frames[turn, number], entries[number], roll_deg)
            fresh[sees[turn, number]] *= SEEN
            near_mm = np.linalg.norm(tips - tips[number], axis=1)
            worth[near_mm < APART_MM] = -math.inf

    def _room(
        self, plan: ToolPlan, name: str, places: _Doubles
    ) -> Callable[[_Doubles, _Doubles], _Doubles]:
        """Return what tells `looking_at` where a scope leaves a tool room."""
        of, entries, ends, worth = plan.lines(name, places)
        apart_mm = self._radius_mm + thickness_mm(name)
        along = ends - entries
        squared = np.maximum((along**2).sum(axis=1), 1e-9)

        def room(tips: _Doubles, scope_entries: _Doubles) -> _Doubles:
            back = scope_entries - tips
            back /= np.maximum(np.linalg.norm(back, axis=1, keepdims=True), 1e-9)
            is_free = np.ones((len(tips), len(of)), bool)
            for mm in np.linspace(0.0, BESIDE_MM, BESIDES):
                ways = (tips + mm * back)[:, None] - entries
                share = np.clip(np.einsum("nmc,mc->nm", ways, along) / squared, 0, 1)
                off = ways - share[..., None] * along
                is_free &= np.einsum("nmc,nmc->nm", off, off) > apart_mm**2
            found = np.zeros((len(tips), len(places)))
            for number in range(len(of)):
                here = found[:, of[number]]
                np.maximum(here, worth[number] * is_free[:, number], out=here)
            return found

        return room

    def drawn_mm(self, now: _Doubles, pose: ScopePose) -> float:
        """Return the depth at which a scope turns freely from a frame to a pose's line.

        now: 4x4. It is drawn back along its own line.
        """
        way, tip = -now[:3, 2], now[:3, 3]
        depth_mm = max(float((tip - self._lines.middle_mm) @ way), 0.0)
        entry_mm = tip - depth_mm * way
        goal = pose.frame[:3, 3] - pose.entry_mm
        goal_mm = float(np.linalg.norm(goal))
        goal = goal / goal_mm
        share = np.linspace(0.0, 1.0, BETWEEN)[:, None]
        places = entry_mm + share * (pose.entry_mm - entry_mm)
        lines = way + share * (goal - way)
        lines /= np.linalg.norm(lines, axis=1, keepdims=True)
        for back_mm in DRAWN_MM:
            at_mm = min(depth_mm, goal_mm) - back_mm
            if at_mm <= 0.0:
                break
            points = self._lines.points(places, places + at_mm * lines)
            lacks = self._lines.lacks_mm(points, self._radius_mm)
            if lacks.max() < TURNED_MM:
                return at_mm
        return 0.0

    def _lying(self, places: _Doubles) -> tuple[_Doubles, _Doubles, _Doubles]:
        """Return tips about places and their entries, ``(n, 3)``, and how they lie."""
        low, high = places.min(axis=0) - FAR_MM, places.max(axis=0) + FAR_MM
        axes = [np.arange(a, b, STEP_MM) for a, b in zip(low, high, strict=True)]
        tips = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        air = -self._distance.sample(tips) > self._radius_mm - DENT_MM
        inside = (tips - self._lines.middle_mm) @ self._fulcrum.axis > self._radius_mm
        tips = tips[air & inside]
        near_mm, _ = cKDTree(places).query(tips)
        tips = tips[(near_mm > NEAR_MM) & (near_mm < FAR_MM)]
        most = np.full(len(tips), -math.inf)
        entries = np.zeros_like(tips)
        for entry in self._lines.places_mm:
            worth = self._worth(np.broadcast_to(entry, tips.shape), tips)
            is_better = worth > most
            most[is_better], entries[is_better] = worth[is_better], entry
        lies = np.isfinite(most)
        return tips[lies], entries[lies], most[lies]

    def _sees(
        self, tips: _Doubles, entries: _Doubles, places: _Doubles, endoscope: Endoscope
    ) -> tuple[_Doubles, NDArray[np.bool_]]:
        """Return frames of scopes, ``(turns, n, 4, 4)``, and which places they see."""
        ways = places - tips[:, None]
        lengths = np.linalg.norm(ways, axis=2)
        near = (lengths > NEAR_MM) & (lengths < FAR_MM)
        of = np.nonzero(near)[0]
        share = np.linspace(0.0, 1.0, SIGHT) * (1.0 - SIGHT_MM / lengths[near])[:, None]
        rays = tips[of, None] + share[..., None] * ways[near][:, None]
        walls = self._distance.sample(rays.reshape(-1, 3)).reshape(share.shape)
        near[near] = walls.max(axis=1) < 0.0
        ways /= lengths[..., None]
        turns = ROUND if endoscope.angle_deg else 1
        frames = np.stack(
            [
                tip_frames(tips, tips - entries, np.full(len(tips), turn_deg))
                for turn_deg in np.arange(turns) * (360.0 / ROUND)
            ]
        )
        angle = math.radians(endoscope.angle_deg)
        looks = math.sin(angle) * frames[..., 1] - math.cos(angle) * frames[..., 2]
        least = math.cos(math.radians(WITHIN * endoscope.field_of_view_deg / 2))
        # turn by turn: all at once would be much to hold
        sees = [
            near & (np.einsum("npc,nc->np", ways, look[:, :3]) > least)
            for look in looks
        ]
        return frames, np.stack(sees)

    def _worth(self, entries: _Doubles, tips: _Doubles) -> _Doubles:
        """Return how well scopes lie, ``(n,)``; -inf for those that do not."""
        ways = tips - entries
        lengths = np.linalg.norm(ways, axis=1, keepdims=True)
        ends = tips[:, None] - END_RADII * (ways * self._radius_mm / lengths)[:, None]
        points = np.concatenate(
            [ends, self._lines.points(entries, tips, is_whole=True)], axis=1
        )
        lacks = self._lines.lacks_mm(points, self._radius_mm + ROOM_MM)
        off = np.linalg.norm(entries - self._lines.middle_mm, axis=1)
        worth = -lacks.max(axis=1) - ASIDE * lacks.mean(axis=1) - EVEN * off
        if self._hazards is not None:
            near_mm = UNIT_MM * self._hazards.sample(points).min(axis=1)
            near_mm -= self._radius_mm
            worth -= CLEAR * np.maximum(CLEAR_MM - near_mm, 0.0)
        is_in = ways @ self._fulcrum.axis >= lengths[:, 0] * self._least
        is_good = is_in & (lacks.max(axis=1) < ROOM_MM + DENT_MM)
        found: _Doubles = np.where(is_good, worth, -math.inf)
        return found
