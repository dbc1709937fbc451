"""A hand that does an exercise's tasks one after the other, without any picture.

It holds scope and tool as straight lines through the nostril, looks for places where
they fit, and operates with the tools of the catalogue: what it cannot do so, a trainee
need not be able to do.
"""

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import UNIT_MM
from anatomy.tissue import Label
from anatomy.wall_layers import layer_at
from paravol.inputs.hand import nostril_fulcrum
from paravol.patient import PatientScene
from paravol.session_setup import build_session, operate_on, untouched
from renderers.scene import Volume
from scenarios import InstrumentState, Sample, Scenario, Session, tip_frame
from scenarios.instrument_state import EMPTY_HAND
from scenarios.instruments.catalogue import instrument_named
from scenarios.instruments.contact_shape import shaft_mm
from scenarios.tasks import Status
from scenarios.tasks.neck import Neck
from scenarios.tasks.rules import is_in_sight
from scenarios.tasks.task import (
    Follow,
    Held,
    Hold,
    Inject,
    KeepAway,
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
SPARED_MM, HELD_OFF_MM, TOOL_MM = 0.6, 0.2, 1.2
"""What is bitten keeps so far from a hazard, and open jaws; and the middle of a tool
from the margin round it."""
FORCEPS = ("straight forceps", "upturned forceps")
VAIN, TARGETS = 30, 200
"""So often no bite is found before it is given up; how many are thought of for each."""
LEAST_BITE, HARM = 1.0, 10.0
"""A bite takes more wanted voxels than the first; a spared one counts so much."""
CUP_MM = 4.0
"""So far beyond a target the tip goes, at most."""
THROUGH_MM = (-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5)
"""Thickness of the wall round a neck."""
DEEP_MM = 4.0
"""Of tissue deeper than this nothing is looked for."""
TOOL_DENT_MM = 0.0
"""So deep the axis of a tool lies in tissue, at most, before what it bites."""
LOOKS = 60
"""At most, for a site of a survey."""
REACH_MM = 9.0
"""No bite reaches farther from its middle."""
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
        self._hazards = self._joined(with_margins=False)
        self._margins = self._joined(with_margins=True)

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
            case Remove() if not task.asks:
                pass
            case Remove() | Open():
                self.cut(task)
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

    def cut(self, task: Remove | Open) -> None:
        """Bite where most of what is wanted and nothing spared is taken, until done."""
        wanted, spared = self._wanted(task), self._spared()
        random = np.random.default_rng(2)
        vain = 0
        while vain < VAIN:
            left = wanted[self.distance.sample(wanted) > 0.0]
            if self.status(task) is not Status.OPEN or not len(left):
                return
            near = spared[self.distance.sample(spared) > 0.0]
            best, most = None, LEAST_BITE
            for bite in self._bites(left, random):
                worth = float(np.count_nonzero(_inside(bite.rows, left)))
                if worth <= most or self._hurts(bite):
                    continue
                worth -= HARM * np.count_nonzero(_inside(bite.rows, near))
                if worth > most:
                    best, most = bite, worth
            vain += 1
            if best is not None:
                vain = 0
                self._close(best)

    def _bites(
        self, targets: Doubles, random: np.random.Generator
    ) -> "Iterator[_Bite]":
        """Yield bites at some of the targets by the forceps that may be used."""
        tools = [n for n in FORCEPS if n in (self.scenario.tools or FORCEPS)]
        for target in random.choice(targets, TARGETS):
            entry = self._hands[random.integers(len(self._hands))]
            name = tools[random.integers(len(tools))]
            roll_deg = float(random.uniform(-180.0, 180.0))
            jaw = float(random.choice((0.0, 0.5)))
            tip = target + random.uniform(0.0, CUP_MM) * _unit(target - entry)
            way = _unit(tip - entry)
            for _ in range(3):
                # of a bent tool the shaft is what passes the nostril
                frame = tip_frame(tip, way, roll_deg)
                way = _unit(tip + frame[:3, :3] @ shaft_mm(name) - entry)
            frame = tip_frame(tip, way, roll_deg)
            off = shaft_mm(name)
            bend = off + np.array([0.0, 0.0, np.linalg.norm(off)])
            line = np.stack([tip, tip + frame[:3, :3] @ bend, entry])
            rows = instrument_named(name).working_volume(frame, jaw)
            yield _Bite(name, tip, way, roll_deg, jaw, rows, line)

    def _hurts(self, bite: "_Bite") -> bool:
        """Return whether a bite, or the tool on its way, comes too near to a hazard.

        Or lies in tissue behind what it bites.
        """
        ends = bite.rows[:, 1:7].reshape(-1, 3)
        if self._nearest_hazard(ends).min() < bite.rows[0, 7] + SPARED_MM:
            return True
        frame = tip_frame(bite.tip, bite.way, bite.roll_deg)
        for jaw in (bite.jaw, 1.0):
            parts = instrument_named(bite.name).capsules(frame, jaw)
            for ends in (parts.start_mm, parts.end_mm):
                gap = self._nearest_hazard(ends) - parts.radius_mm
                if gap.min() < HELD_OFF_MM:
                    return True
        corners = bite.line
        share = np.linspace(0.0, 1.0, LINE_POINTS)[:, None]
        line = np.concatenate(
            [a + share * (b - a) for a, b in itertools.pairwise(corners)]
        )
        behind = np.linalg.norm(line - bite.tip, axis=1) > BITTEN_MM
        if self.distance.sample(line[behind]).max() > TOOL_DENT_MM:
            return True
        return bool(self._nearest_hazard(line, is_kept_off=True).min() < TOOL_MM)

    def _close(self, bite: "_Bite") -> None:
        for jaw in (bite.jaw, bite.jaw, 0.6, 1.0):
            state = InstrumentState(bite.name, bite.roll_deg, jaw, jaw > bite.jaw)
            self._step(bite.tip, bite.way, state)
        # drawn back: the way to the next bite leads through nothing
        self.stay(STEP_S)

    def _wanted(self, task: Remove | Open) -> Doubles:
        """Return where there is what a task wants taken."""
        head = untouched(self.patient)
        if isinstance(task, Open):
            start, end = self.place(task.start), self.place(task.end)
            plane = Neck.between(head.distance, start, end)
            off = plane.points - plane.middle
            wide_mm = max(task.radius_mm, 1.15 * math.sqrt(task.area_mm2 / math.pi))
            near = plane.points[np.linalg.norm(off, axis=2) < wide_mm][::4]
            return np.concatenate([near + d * plane.normal for d in THROUGH_MM])
        found = [head.part(name) for name, s in task.parts.items() if s.least_percent]
        places = [head.places(part.voxels) for part in found if part is not None]
        places += [
            self._labelled({Label[name.upper().replace(" ", "_")]})
            for name, limit in task.tissues.items()
            if limit.least_mm3
        ]
        return np.concatenate(places)

    def _spared(self) -> Doubles:
        """Return where there is tissue of which the exercise allows but little."""
        names = {
            name
            for task in self.scenario.tasks
            if isinstance(task, Remove)
            for name, limit in {**task.tissues, **task.walls}.items()
            if limit.most_mm3 is not None
        }
        labels = {Label[n.upper().replace(" ", "_")] for n in names}
        return self._labelled(labels)

    def _labelled(self, labels: Collection[Label]) -> Doubles:
        """Return the voxels of tissues, as the books name them, on the side."""
        pristine, layers = self.patient.surface.distance, self.patient.layers
        assert layers is not None
        k, j, i = np.nonzero((pristine.values > 0.0) & (pristine.values < DEEP_MM))
        matrix = pristine.world_from_voxel
        points = np.stack([i, j, k], axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
        points = points[(points[:, 0] < 0.0) == (self._pivot[0] < 0.0)]
        found = layer_at(layers, pristine, points).label
        kept: Doubles = points[np.isin(found, list(labels))]
        return kept

    # places

    def _nearest_hazard(self, points: Doubles, *, is_kept_off: bool = False) -> Doubles:
        """Return how near points lie to what is to be kept away from, mm.

        is_kept_off: or to the margin round it.
        """
        field = self._margins if is_kept_off else self._hazards
        if field is None:
            return np.full(len(points), np.inf)
        return field.sample(points) * UNIT_MM

    def _joined(self, *, with_margins: bool) -> Volume | None:
        """Return the distance to the nearest of all hazards of the exercise."""
        found: Volume | None = None
        for task in self.scenario.tasks:
            if self.patient.hazards is None or not isinstance(task, KeepAway):
                continue
            off = task.margin_mm / UNIT_MM if with_margins else 0.0
            for name in task.hazards:
                one = self.patient.hazards.volumes[name]
                values = (one.values - off).astype(np.float32)
                if found is not None:
                    values = np.minimum(values, found.values)
                found = one.with_values(values, one.background)
        return found

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


@dataclass(frozen=True)
class _Bite:
    """Hold a bite: tool and pose, how wide its jaws are, what it takes, its line."""

    name: str
    tip: Doubles
    way: Doubles
    roll_deg: float
    jaw: float
    rows: Doubles
    line: Doubles


def _inside(rows: Doubles, points: Doubles) -> NDArray[np.bool_]:
    """Return which points lie in capsules."""
    starts, ways = rows[:, 1:4], rows[:, 4:7] - rows[:, 1:4]
    middle = rows[:, 1:7].reshape(-1, 3).mean(axis=0)
    found = np.zeros(len(points), bool)
    near = np.flatnonzero(np.linalg.norm(points - middle, axis=1) < REACH_MM)
    if not len(near):
        return found
    off = points[near][:, None] - starts
    squares = np.maximum((ways * ways).sum(axis=1), 1e-12)
    share = np.clip((off * ways).sum(axis=2) / squares, 0.0, 1.0)
    gaps = np.linalg.norm(off - share[..., None] * ways, axis=2) - rows[:, 7]
    found[near] = gaps.min(axis=1) < 0.0
    return found


def _unit(way: Doubles) -> Doubles:
    return way / np.linalg.norm(way)


def undone(hand: ScriptedHand) -> Sequence[str]:
    """Return the names of required tasks that were not done, and why."""
    optional = {t.name for t in hand.scenario.tasks if t.is_optional}
    assert hand.session.tasks is not None
    return [
        f"{s.name}: {s.status} {s.progress:.2f} {s.why}"
        for s in hand.session.tasks.ended()
        if s.status is not Status.DONE and s.name not in optional
    ]
