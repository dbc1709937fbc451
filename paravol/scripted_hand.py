"""A hand that does an exercise's tasks one after the other, without any picture.

It holds scope and tool as straight lines through the nostril, looks for places where
they fit, and operates with the tools of the catalogue: what it cannot do so, a trainee
need not be able to do.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from anatomy.tissue import Label
from paravol.inputs.hand import nostril_fulcrum
from paravol.patient import PatientScene
from paravol.session_setup import build_session, operate_on
from renderers.scene import Volume
from scenarios import InstrumentState, Sample, Scenario, Session, tip_frame
from scenarios.instrument_state import EMPTY_HAND
from scenarios.tasks import Status
from scenarios.tasks.rules import is_in_sight
from scenarios.tasks.task import (
    Follow,
    Held,
    Hold,
    Inject,
    Look,
    Open,
    Reach,
    Remove,
    Survey,
    Task,
)

Doubles = NDArray[np.float64]

STEP_S = 0.1
ENTRY_MM = 4.5
"""A shaft passes so near to the pivot."""
DENT_MM = 1.5
"""So deep a shaft presses mucosa aside, at most."""
AWAY_MM = np.array([0.0, -400.0, -400.0])
BITTEN_MM = 5.0
"""The last part of a bite's way lies in what is bitten."""
SPARED_MM = 4.0
"""No jaw is opened so near to a hazard."""
TOOL_DENT_MM = 0.0
"""So deep the axis of a tool lies in tissue, at most, before what it bites."""
LOOKS = 60
"""At most, for a site of a survey."""
LINE_POINTS = 60
"""At which a shaft's line is looked at."""


@dataclass
class ScriptedHand:
    """Do a scenario's tasks; `session.tasks` says which were done.

    samples: what it did, each 0.1 s. A place that it cannot come to ends it with an
    AssertionError that names it.
    """

    scenario: Scenario
    patient: PatientScene
    operates: bool = True
    session: Session = field(init=False)
    time_s: float = 0.0
    injuries: list[str] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)

    def __post_init__(self) -> None:
        patient, operation = self.patient, None
        if self.operates:
            patient, operation = operate_on(patient)
        self.session = build_session(
            self.scenario, patient, np.eye(4), (64, 64), operation
        )
        self._operation = operation
        fulcrum = nostril_fulcrum(self.patient, None, self.scenario.start)
        self._pivot = fulcrum.pivot_mm
        self._axis = fulcrum.axis / np.linalg.norm(fulcrum.axis)
        self._scope = self.scenario.scope.endoscope()
        random = np.random.default_rng(1)
        aside = random.normal(size=(40, 3)) * ENTRY_MM / 2
        aside -= (aside @ self._axis)[:, None] * self._axis
        self._entries = np.vstack([np.zeros(3), aside]) + self._pivot
        inwards = 2.6 if self._pivot[0] < 0.0 else -2.6
        hand = self._pivot + np.array([inwards, 0.0, 6.5])
        self._hands = hand + np.vstack([np.zeros(3), aside[:8] / 2])
        self._tip, self._entry = self._pivot, self._pivot - 30.0 * self._axis
        self._roll_deg = 0.0
        self._camera_deg = self.scenario.scope.camera_roll_deg

    @property
    def distance(self) -> Volume:
        """Return the air of the head as it is cut now."""
        if self._operation is not None:
            return self._operation.patient.surface.distance
        return self.patient.surface.distance

    def do_all(self) -> None:
        """Do every task that has an action of its own, in their order."""
        self.stay(0.2)
        for task in self.scenario.tasks:
            if not task.is_optional and self.status(task) is Status.OPEN:
                self.do(task)
            self.stay(STEP_S)

    def status(self, task: Task) -> Status:
        """Return how a task stands."""
        assert self.session.tasks is not None
        return next(s.status for s in self.session.tasks.states if s.name == task.name)

    def do(self, task: Task) -> None:
        """Do one task."""
        match task:
            case Reach() | Hold():
                assert task.held is Held.SCOPE
                self.bring(self.place(task.place), task.radius_mm)
                self.stay(task.hold_s + 2 * STEP_S)
            case Look():
                if task.level_deg < 180.0:
                    self.stay(task.hold_s)
                    assert self.status(task) is Status.OPEN
                    self._camera_deg = 0.0
                self.look(task)
                self.stay(task.hold_s + 2 * STEP_S)
            case Follow():
                for ring in task.rings:
                    middle = self.place(ring.place)
                    entry = self._entries[0]
                    way = (middle - entry) / np.linalg.norm(middle - entry)
                    self.go(middle + 1.5 * way, entry, 0.0)
                    self.back()
            case Inject():
                self.inject(task)
            case Remove():
                self.cut(task, self._targets(task))
            case Open():
                self.cut(task, self._way(task))
            case Survey():
                self.survey(task)

    def place(self, place: str | tuple[float, float, float]) -> Doubles:
        """Return a place of a task."""
        return (
            self.patient.landmarks[place] if isinstance(place, str) else np.array(place)
        )

    # the scope

    def bring(self, place: Doubles, within_mm: float) -> None:
        """Bring the tip to a place."""
        tips, entries, clear = self._ways(self._ball(place, within_mm - 0.1))
        assert len(clear), "no straight scope reaches the place"
        best = int(clear.argmax())
        self.go(tips[best], entries[best], 0.0)

    def look(self, task: Look) -> None:
        """Find a pose from which the place is seen, and go there."""
        place = self.place(task.place)
        near = self._ball(place, min(task.farthest_mm, 40.0) - 0.5)
        away = np.linalg.norm(near - place, axis=1)
        tips, entries, clear = self._ways(near[away > task.nearest_mm + 0.5])
        shaft = tips - entries
        shaft /= np.linalg.norm(shaft, axis=1, keepdims=True)
        ahead = place - tips
        ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
        between = np.degrees(np.arccos(np.clip((shaft * ahead).sum(1), -1, 1)))
        off_deg = np.abs(between - self._scope.angle_deg)
        worth = clear - 0.2 * np.maximum(off_deg - 0.5 * task.within_deg, 0.0)
        for n in np.argsort(-worth):
            if off_deg[n] > 0.9 * task.within_deg:
                continue
            if is_in_sight(self.distance, tips[n], place):
                roll = self._roll_towards(tips[n], shaft[n], place)
                self.go(tips[n], entries[n], roll)
                return
        raise AssertionError(f"{task.name}: nowhere is {task.place} seen from")

    def survey(self, task: Survey) -> None:
        """Look at patches of the sites that are not seen yet, until enough are."""
        watch = self.session.coverage
        assert watch is not None
        mucosa, random = watch.mucosa, np.random.default_rng(5)
        within = self._scope.field_of_view_deg / 2 - 8.0
        for name in task.sites:
            wanted = np.isin(mucosa.site, mucosa.members[name])
            # from before the patches one sees them
            chosen = random.choice(np.flatnonzero(wanted), 1500)
            off = random.uniform(3.0, 20.0, (1500, 1)) * mucosa.normals[chosen]
            tips, entries, _ = self._ways(mucosa.places[chosen] + off)
            shaft = tips - entries
            shaft /= np.linalg.norm(shaft, axis=1, keepdims=True)
            for _ in range(LOOKS):
                left = np.flatnonzero(wanted & ~watch.seen)
                if self.status(task) is not Status.OPEN or not len(left):
                    break
                patch = int(random.choice(left))
                wanted[patch] = False
                place = mucosa.places[patch]
                ahead = place - tips
                away = np.linalg.norm(ahead, axis=1)
                ahead /= away[:, None]
                turn = np.degrees(np.arccos(np.clip((shaft * ahead).sum(1), -1, 1)))
                good = np.abs(turn - self._scope.angle_deg) < within
                good &= (away > 4.0) & (away < 30.0)
                good &= ahead @ mucosa.normals[patch] < -0.4
                for n in random.permutation(np.flatnonzero(good))[:6]:
                    if is_in_sight(self.distance, tips[n], place):
                        roll = self._roll_towards(tips[n], shaft[n], place)
                        self.go(tips[n], entries[n], roll)
                        self.stay(0.6)
                        break

    def _roll_towards(self, tip: Doubles, shaft: Doubles, place: Doubles) -> float:
        """Return the turn of the light post that looks at a place, degrees."""
        frame = tip_frame(tip, shaft)
        right, up = frame[:3, 0], frame[:3, 1]
        ahead = place - tip
        return math.degrees(math.atan2(ahead @ right, ahead @ up))

    def go(self, tip: Doubles, entry: Doubles, roll_deg: float) -> None:
        """Draw back to the nostril, then go in along a straight line."""
        self.back()
        way = tip - entry
        for share in np.linspace(0.0, 1.0, max(int(np.linalg.norm(way) / 6), 2)):
            self._put(entry + share * way, entry, roll_deg)

    def back(self) -> None:
        """Draw the scope back to the nostril."""
        way = self._tip - self._entry
        for share in np.linspace(1.0, 0.0, max(int(np.linalg.norm(way) / 6), 2)):
            self._put(self._entry + share * way, self._entry, self._roll_deg)

    def stay(self, seconds: float) -> None:
        """Hold the scope where it is."""
        for _ in range(math.ceil(seconds / STEP_S - 1e-9)):
            self._put(self._tip, self._entry, self._roll_deg)

    # the tool

    def inject(self, task: Inject) -> None:
        """Put the needle into the nearest tissue that it reaches."""
        place = self.place(task.place)
        points = self._ball(place, task.radius_mm - 0.1)
        depth = self.distance.sample(points)
        points = points[(depth > 0.1) & (depth < 0.8 * task.deepest_mm)][:200]
        assert len(points), f"{task.name}: nothing to inject"
        tips, entries, dents = self._lines(points, task.deepest_mm + 0.5)
        best = int(dents.argmin())
        least = dents[best]
        assert least < DENT_MM, f"{task.name}: {least:.1f} mm of tissue on the way"
        count = math.ceil(task.hold_s / STEP_S) + 3
        for is_down in [False, *[True] * count, False]:
            self._tool(task.tool, tips[best], entries[best], is_working=is_down)

    def cut(self, task: Task, targets: Callable[[], Doubles]) -> None:
        """Bite, or shave, at the nearest targets that are left, until it is done."""
        names = self.scenario.tools or ("straight forceps",)
        name = next(n for n in names if n in ("straight forceps", "microdebrider"))
        tried: list[Doubles] = []
        for _ in range(150):
            if self.status(task) is not Status.OPEN:
                return
            left = targets()
            if tried:
                apart = np.linalg.norm(left[:, None] - np.array(tried), axis=2)
                left = left[apart.min(axis=1) > 0.6]
            found = self._reachable(left)
            if found is None:
                return
            tried.append(found[0])
            self._bite(name, *found)

    def _bite(self, name: str, tip: Doubles, entry: Doubles) -> None:
        if name == "microdebrider":
            for ahead in (-1.0, 0.0, 1.0):
                way = (tip - entry) / np.linalg.norm(tip - entry)
                for roll in (-120.0, 0.0, 120.0):
                    self._tool(
                        name,
                        tip + ahead * way,
                        entry,
                        is_working=True,
                        is_sucking=True,
                        roll_deg=roll,
                    )
            self._tool(name, tip, entry)
            return
        for jaw in (0.0, 0.0, 0.5, 1.0):
            self._tool(name, tip, entry, is_working=jaw > 0.0, jaw=jaw)

    def _reachable(self, targets: Doubles) -> tuple[Doubles, Doubles] | None:
        """Return the target with most air on the way of a straight tool."""
        targets = targets[self._nearest_hazard(targets) > SPARED_MM]
        targets = targets[:: max(len(targets) // 150, 1)]
        if not len(targets):
            return None
        tips, entries, dents = self._lines(targets, BITTEN_MM, self._hands)
        back = entries - tips
        back /= np.linalg.norm(back, axis=1, keepdims=True)
        for behind_mm in (3.0, 6.0, 9.0):
            gap = self._nearest_hazard(tips + behind_mm * back)
            dents[gap < SPARED_MM] = np.inf
        best = int(dents.argmin())
        return (tips[best], entries[best]) if dents[best] < TOOL_DENT_MM else None

    def _targets(self, task: Remove) -> Callable[[], Doubles]:
        """Return what gives the voxels of the wanted tissue on the side of the nose."""
        structures = self.patient.structures
        assert structures is not None
        limits = {**task.tissues, **task.walls}
        names = [name for name, limit in limits.items() if limit.least_mm3 > 0.0]
        labels = [
            label
            for label in Label
            if any(
                label.name.lower().replace("_", " ")
                in name.replace("process", "").strip()
                for name in names
            )
        ]
        k, j, i = np.nonzero(np.isin(structures.labels.values, labels))
        matrix = structures.labels.world_from_voxel
        points = np.stack([i, j, k], axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
        points = points[(points[:, 0] < 0.0) == (self._pivot[0] < 0.0)]
        points = points[:: max(len(points) // 4000, 1)]

        def left() -> Doubles:
            there: Doubles = points[self.distance.sample(points) > 0.0]
            return there

        return left

    def _way(self, task: Open) -> Callable[[], Doubles]:
        """Return what gives the tissue that is left along a way."""
        start, end = self.place(task.start), self.place(task.end)
        middle = np.linspace(start, end, int(np.linalg.norm(end - start) / 0.5) + 2)
        random = np.random.default_rng(3)
        aside = random.normal(size=(12, 3))
        wide_mm = max(task.radius_mm, 1.15 * math.sqrt(task.area_mm2 / math.pi))
        aside *= wide_mm / np.linalg.norm(aside, axis=1, keepdims=True)
        points = (middle[:, None] + np.vstack([np.zeros(3), aside])).reshape(-1, 3)

        def left() -> Doubles:
            there: Doubles = points[self.distance.sample(points) > -0.2]
            return there

        return left

    # places

    def _nearest_hazard(self, points: Doubles) -> Doubles:
        """Return how near points lie to what is to be kept away from, mm."""
        nearest = np.full(len(points), np.inf)
        hazards = self.patient.hazards
        if hazards is not None:
            for task in self.scenario.tasks:
                for name in getattr(task, "hazards", ()):
                    gap = hazards.volumes[name].sample(points)
                    nearest = np.minimum(nearest, gap)
        return nearest

    def _lines(
        self, tips: Doubles, but_mm: float, entries: Doubles | None = None
    ) -> tuple[Doubles, Doubles, Doubles]:
        """Return each tip with the entry from which least tissue is on its way.

        The third: how deep the axis lies in tissue, mm, but for its last part.
        """
        entries = self._entries[:24] if entries is None else entries
        way = tips[:, None] - entries
        length = np.linalg.norm(way, axis=2)
        share = np.linspace(0.0, 1.0, LINE_POINTS)
        along = share * np.maximum(1.0 - but_mm / length, 0.1)[..., None]
        points = entries[:, None] + along[..., None] * way[..., None, :]
        dents = self.distance.sample(points.reshape(-1, 3)).reshape(points.shape[:3])
        worst = dents.max(axis=2)
        best = worst.argmin(axis=1)
        return tips, entries[best], worst[np.arange(len(tips)), best]

    def _ball(self, place: Doubles, radius_mm: float) -> Doubles:
        random = np.random.default_rng(4)
        points = random.normal(size=(3000, 3))
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        share = random.uniform(size=(3000, 1)) ** (1 / 3)
        ball: Doubles = np.vstack([place, place + radius_mm * share * points])
        return ball

    def _ways(self, tips: Doubles) -> tuple[Doubles, Doubles, Doubles]:
        """Return poses of the scope, tip and entry, with the air around its shaft."""
        half = self._scope.diameter_mm / 2
        is_free = self.distance.sample(tips) < DENT_MM - half
        is_ahead = (tips - self._pivot) @ self._axis > 2.0
        tips, entries, dents = self._lines(tips[is_free & is_ahead][:1000], 0.0)
        fits = dents < DENT_MM - half
        return tips[fits], entries[fits], -half - dents[fits]

    # samples

    def _put(self, tip: Doubles, entry: Doubles, roll_deg: float) -> None:
        self._tip, self._entry, self._roll_deg = tip, entry, roll_deg
        self._step(AWAY_MM, np.array([0.0, 1.0, 0.0]), EMPTY_HAND)

    def _tool(
        self,
        name: str,
        tip: Doubles,
        entry: Doubles,
        *,
        jaw: float = 0.0,
        is_working: bool = False,
        is_sucking: bool = False,
        roll_deg: float = 0.0,
    ) -> None:
        way = (tip - entry) / np.linalg.norm(tip - entry)
        state = InstrumentState(name, roll_deg, jaw, is_working, is_sucking)
        self._step(tip, way, state)

    def _step(self, tip: Doubles, way: Doubles, state: InstrumentState) -> None:
        self.time_s += STEP_S
        pointing = self._tip - self._entry
        if np.linalg.norm(pointing) < 1e-6:
            pointing = self._axis
        pointing = pointing / np.linalg.norm(pointing)
        pose = tip_frame(self._tip, pointing)
        sample = Sample(
            self.time_s,
            pose,
            self._roll_deg,
            tip,
            way,
            0,
            state,
            camera_roll_deg=self._camera_deg,
        )
        self.samples.append(sample)
        self.session.step(sample)
        if self._operation is not None:
            self._operation.take_changes()
            self._operation.take_edits()
            self.injuries += [i.structure for i in self._operation.take_injuries()]


def undone(hand: ScriptedHand) -> Sequence[str]:
    """Return the names of required tasks that were not done, and why."""
    optional = {t.name for t in hand.scenario.tasks if t.is_optional}
    assert hand.session.tasks is not None
    return [
        f"{s.name}: {s.status} {s.progress:.2f} {s.why}"
        for s in hand.session.tasks.ended()
        if s.status is not Status.DONE and s.name not in optional
    ]
