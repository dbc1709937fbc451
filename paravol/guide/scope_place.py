"""Where an assistant lays the scope, so that a place is seen and a tool gets there."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from devices.controls.fulcrum import Fulcrum
from paravol.guide.goals import Goal, GuidedHead, goal_of, tool_places
from paravol.inputs.nostril_lines import LEAN_MM, RINGS, NostrilLines
from renderers.scene import Volume
from scenarios import Endoscope, View, tip_frame
from scenarios.tasks import Task, TaskState

_Doubles = NDArray[np.float64]

AWAY_MM = 11.0, 14.0, 17.0, 21.0, 9.0
"""From the lens to what is operated; nearer the scope leaves a tool no room."""

ROUND = 24
"""Sides from which a place is looked at, for each distance."""

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

APART_MM = 3.0
"""Scopes whose tips are nearer to each other see the same."""

DRAWN_MM = 0.0, 4.0, 8.0, 13.0, 20.0, 30.0, 40.0
"""So far a scope is drawn back to be turned, as little as will do."""

BETWEEN = 6
"""Poses on the way from one to another that are looked at."""

TRIED, GOOD = 12, 25.0
"""Poses for which a tool's ways are looked at, at most; none after one at which it is
worth so much."""

GRIPPED = 24
"""Places at which it is tried from each, at most."""

PLACES, SKIN_MM = 30, 1.2
"""Places that are looked at where the first is seen from nowhere; they lie so deep in
tissue at most."""


class ScopePose(NamedTuple):
    """Hold how a scope lies: its tip's frame, 4x4, its y axis at the light post.

    entry_mm: ``(3,)`` where it passes the nostril. roll_deg: of the light post. seen,
    goal: the view from there, and where the tool in hand works best in it.
    """

    frame: _Doubles
    entry_mm: _Doubles
    roll_deg: float
    seen: View | None = None
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
        self._endoscope, self._cone_deg = endoscope, cone_deg
        self._hazards = hazards.nearest if hazards and hazards.names else None
        self._radius_mm = endoscope.diameter_mm / 2
        self._lines = NostrilLines(fulcrum, distance, LEAN_MM, RINGS)

    def for_tool(
        self,
        task: Task,
        state: TaskState,
        head: GuidedHead,
        view: View,
        left_out: Sequence[_Doubles] = (),
    ) -> ScopePose | None:
        """Return the pose from which the tool in hand does most of what a task asks.

        None where it does nothing from any. view: as it is now. left_out: tips,
        ``(3,)``, that lead nowhere.
        """
        tip, endoscope = view.world_from_tip[:3, 3], self._endoscope.at(view.scope_deg)
        goal = goal_of(task, state, head, tip)
        if goal is None:
            return None
        head = replace(head, gripped=GRIPPED)
        places = tool_places(task, head)
        deep = self._distance.nearest(places)
        places = places[(deep > 0.0) & (deep < SKIN_MM)]
        places = places[:: max(len(places) // PLACES, 1)]
        best, most = None, 0.0
        tried = [*left_out]
        for pose in chain.from_iterable(
            self.looking_at(place, endoscope) for place in (goal.place_mm, *places)
        ):
            tip = pose.frame[:3, 3]
            if any(float(np.linalg.norm(tip - each)) < APART_MM for each in tried):
                continue
            tried.append(tip)
            size = view.camera.width, view.camera.height
            camera = endoscope.camera(pose.frame, pose.roll_deg, size)
            seen = replace(view, camera=camera, world_from_tip=pose.frame)
            found = goal_of(task, state, head, tip, camera.eye_mm, seen)
            if found is not None and found.worth > most:
                most = found.worth
                best = pose._replace(seen=seen, goal=found)
            if len(tried) == len(left_out) + TRIED or most > GOOD:
                break
        return best

    def looking_at(self, place: _Doubles, endoscope: Endoscope) -> Iterator[ScopePose]:
        """Give poses that see a place, ``(3,)``, in the picture's middle, best first.

        Each lies elsewhere than those before. None are given that dent walls deeper
        than `DENT_MM`.
        """
        entries, tips = self._candidates(place, endoscope.angle_deg)
        ways = tips - entries
        lengths = np.linalg.norm(ways, axis=1)
        axis = self._fulcrum.axis
        is_in = ways @ axis >= lengths * math.cos(math.radians(self._cone_deg))
        entries, tips = entries[is_in], tips[is_in]
        worth = self._worth(entries, tips, place)
        taken: list[_Doubles] = []
        for number in np.argsort(-worth):
            if not np.isfinite(worth[number]):
                return
            tip = tips[number]
            if all(float(np.linalg.norm(tip - each)) > APART_MM for each in taken):
                taken.append(tip)
                yield self._pose(entries[number], tip, place)

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

    def _candidates(
        self, place: _Doubles, angle_deg: float
    ) -> tuple[_Doubles, _Doubles]:
        """Return entries and tips, ``(n, 3)`` each, that see a place as scopes do."""
        entries = self._lines.places_mm
        shafts = np.broadcast_to(place - entries, (len(AWAY_MM), ROUND, *entries.shape))
        turns = np.arange(ROUND) * (2.0 * math.pi / ROUND)
        cosine, sine = np.cos(turns)[:, None, None], np.sin(turns)[:, None, None]
        angle = math.radians(angle_deg)
        away = np.array(AWAY_MM)[:, None, None, None]
        for _ in range(3):
            # who looks aside lies beside the line to the place, and leans there
            shafts = shafts / np.linalg.norm(shafts, axis=-1, keepdims=True)
            right = np.cross(shafts, self._fulcrum.up)
            right /= np.linalg.norm(right, axis=-1, keepdims=True)
            post = cosine * np.cross(right, shafts) + sine * right
            tips = place - away * (math.cos(angle) * shafts + math.sin(angle) * post)
            shafts = tips - entries
        tips = tips.reshape(-1, 3)
        return np.tile(entries, (len(tips) // len(entries), 1)), tips

    def _worth(self, entries: _Doubles, tips: _Doubles, place: _Doubles) -> _Doubles:
        """Return how well scopes lie and see, ``(n,)``; -inf for those that do not."""
        back = entries - tips
        back *= self._radius_mm / np.linalg.norm(back, axis=1, keepdims=True)
        ends = tips[:, None] + END_RADII * back[:, None]
        points = np.concatenate(
            [ends, self._lines.points(entries, tips, is_whole=True)], axis=1
        )
        lacks = self._lines.lacks_mm(points, self._radius_mm + ROOM_MM)
        ways = place - tips
        lengths = np.linalg.norm(ways, axis=1)
        share = np.linspace(0.0, 1.0, SIGHT) * (1.0 - SIGHT_MM / lengths)[:, None]
        rays = tips[:, None] + share[..., None] * ways[:, None]
        seen = self._distance.sample(rays.reshape(-1, 3)).reshape(share.shape)
        off = np.linalg.norm(entries - self._lines.middle_mm, axis=1)
        worth = -lacks.max(axis=1) - ASIDE * lacks.mean(axis=1) - EVEN * off
        if self._hazards is not None:
            near_mm = UNIT_MM * self._hazards.sample(points).min(axis=1)
            near_mm -= self._radius_mm
            worth -= CLEAR * np.maximum(CLEAR_MM - near_mm, 0.0)
        is_good = (lacks.max(axis=1) < ROOM_MM + DENT_MM) & (seen.max(axis=1) < 0.0)
        found: _Doubles = np.where(is_good, worth, -math.inf)
        return found

    def _pose(self, entry: _Doubles, tip: _Doubles, place: _Doubles) -> ScopePose:
        """Return a scope whose light post is turned so that it sees a place."""
        upright = tip_frame(tip, tip - entry)
        right, up = upright[:3, 0], upright[:3, 1]
        roll_deg = math.degrees(
            math.atan2(float((place - tip) @ right), float((place - tip) @ up))
        )
        return ScopePose(tip_frame(tip, tip - entry, roll_deg), entry, roll_deg)
