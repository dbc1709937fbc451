"""A hand that does an exercise's tasks one after the other, without any picture.

It holds scope and tool as straight lines through the nostril, looks for places where
they fit, and operates with the tools of the catalogue: what it cannot do so, a trainee
need not be able to do.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import UNIT_MM
from paravol.inputs.hand import nostril_fulcrum
from paravol.inputs.nostril_lines import NostrilLines
from paravol.inputs.pointed_tool import thickness_mm
from paravol.inputs.tool_hold import BITES_MM, TOUCH_MM
from paravol.inputs.tool_plan import ENTRY_MM as TOOL_MM
from paravol.inputs.tool_plan import RINGS, tip_frames
from paravol.patient import PatientScene
from paravol.sessions.session_setup import build_session, operate_on, untouched
from renderers.scene import Volume
from scenarios import InstrumentState, Sample, Scenario, Session, tip_frame
from scenarios.instrument_state import EMPTY_HAND
from scenarios.instruments.catalogue import instrument_named
from scenarios.instruments.contact_shape import shaft_mm
from scenarios.instruments.parts import moved
from scenarios.tasks import Status
from scenarios.tasks.neck import Neck
from scenarios.tasks.rules import is_in_sight
from scenarios.tasks.task import (
    Follow,
    Held,
    Hold,
    Inject,
    LookTask,
    Open,
    Reach,
    Remove,
    Survey,
    Task,
)
from surgery.kernels.carve import FULL
from surgery.solids import BLADE, CAPSULE, in_capsules

Doubles = NDArray[np.float64]

STEP_S = 0.1
ENTRY_MM = 4.5
"""A shaft passes so near to the pivot."""
DENT_MM = 1.5
"""So deep a shaft presses mucosa aside, at most."""
AWAY_MM = np.array([0.0, -400.0, -400.0])
BITTEN_MM = 5.0
"""The last part of a bite's way lies in what is bitten, at most."""
SPARED_MM = 0.2
"""What is bitten keeps so far from what must not be hurt."""
BLOCKED_MM, NEAR_MM = 3.0, 12.0
"""What has to be pressed farther, but not farther than this, is taken out of the way
where it is so near to the tip."""
BITING = (
    "straight forceps",
    "upturned forceps",
    "through-cutting punch",
    "backbiter",
    "microdebrider",
)
VAIN, TRIED, COMPARED = 60, 1000, 150
"""So often no bite is found before it is given up; how many are thought of for each
tool and each width of its jaws; and how many of those that go are compared."""
CHEAPER = 0.95
"""The longer no bite is found, the less it counts that a bite harms."""
WASTE = 0.05
"""What is taken besides counts so much of what is wanted as harm."""
THROUGH_MM = 1.5
"""Thickness of the wall before a neck."""
LOOKS = 60
"""At most, for a site of a survey."""
LINE_POINTS = 60
"""At which a shaft's line is looked at."""
TOOL_POINTS, LONGEST_MM = 60, 90.0
"""Likewise a tool's, as far as that."""


@dataclass
class ScriptedHand:
    """Do a scenario's tasks; `session.tasks` says which were done.

    samples: what it did, each 0.1 s. A place that it cannot come to ends it with an
    AssertionError that names it.
    """

    scenario: Scenario
    patient: PatientScene
    operates: bool = True
    pressed_mm: ClassVar[float] = BITES_MM + TOUCH_MM
    """So deep a tool that works presses tissue aside, at most, as in the window."""
    session: Session = field(init=False)
    time_s: float = 0.0
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
        self._hands = NostrilLines(fulcrum, self.distance, TOOL_MM, RINGS).places_mm
        self._tip, self._entry = self._pivot, self._pivot - 30.0 * self._axis
        self._roll_deg = 0.0
        self._camera_deg = self.scenario.scope.camera_roll_deg

    @property
    def distance(self) -> Volume:
        """Return the air of the head as it is cut now."""
        if self._operation is not None:
            return self._operation.patient.surface.distance
        return self.patient.surface.distance

    @property
    def tissue(self) -> str:
        """Return a hash of the head as it is cut now; "" where nobody operates."""
        return "" if self._operation is None else self._operation.patient.hash()

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
            case LookTask():
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

    def look(self, task: LookTask) -> None:
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
        way = _unit(tips[best] - entries[best])
        for is_down in [False, *[True] * count, False]:
            state = InstrumentState(task.tool, is_working=is_down)
            self._step(tips[best], way, state)

    def cut(self, task: Remove | Open) -> None:
        """Bite where most of what is wanted and least else is taken, until done."""
        wanted, random, vain = self._wanted(task), np.random.default_rng(2), 0
        in_the_way = np.zeros((0, 3))
        while self.status(task) is Status.OPEN and vain < VAIN:
            wanted = wanted[self.distance.sample(wanted) > 0.0]
            if not len(wanted):
                return
            aims = np.concatenate([wanted, in_the_way]) if vain else wanted
            bites, in_the_way = self._bites(aims, random)
            price = CHEAPER**vain
            worths = np.array([self._worth(bite, aims, price) for bite in bites])
            best = np.argsort(-worths)[: np.count_nonzero(worths > 0.0)]
            vain = 0 if any(self._close(bites[n]) for n in best) else vain + 1

    def _bites(
        self, targets: Doubles, random: np.random.Generator
    ) -> "tuple[list[Bite], Doubles]":
        """Return bites of some targets, by tools that get there through air.

        Only what a tool bites it lies in, so far as tissue is that thin. And what is in
        the way of others, near them.
        """
        found, in_the_way = [], [np.zeros((0, 3))]
        for name in BITING:
            if self.scenario.tools and name not in self.scenario.tools:
                continue
            for jaw in (0.0, 0.5):
                rows, off = _held(name, jaw), shaft_mm(name)
                some = random.choice(targets, TRIED)
                entries = random.choice(self._hands, TRIED)
                rolls = random.uniform(-180.0, 180.0, TRIED)
                grips = random.choice(rows, TRIED)
                share = random.uniform(size=(TRIED, 1))
                grips = grips[:, 1:4] + share * (grips[:, 4:7] - grips[:, 1:4])
                ways = some - entries
                for _ in range(3):
                    # of a bent tool the shaft is what passes the nostril
                    frames = tip_frames(some, ways, rolls)
                    turns = np.ascontiguousarray(frames[:, :3, :3])
                    tips = some - np.einsum("nab,nb->na", turns, grips)
                    ways = tips + turns @ off - entries
                middle = middle_of(off)
                line = tips[:, None] + middle @ turns.transpose(0, 2, 1)
                depths = self.distance.sample(line)
                is_bitten = np.linalg.norm(middle, axis=1) < BITTEN_MM
                is_outside = middle[:, 2] > np.linalg.norm(ways, axis=1)[:, None]
                depths[is_outside | (is_bitten & in_capsules(rows, middle))] = -np.inf
                deepest = depths.argmax(axis=1)
                pressed_mm = depths.max(axis=1) + thickness_mm(name)
                for n in np.flatnonzero(pressed_mm < self.pressed_mm):
                    frame = tip_frame(tips[n], ways[n], rolls[n])
                    found.append(Bite(name, frame, rolls[n], jaw))
                is_blocked = (pressed_mm >= self.pressed_mm) & (pressed_mm < BLOCKED_MM)
                is_blocked &= np.linalg.norm(middle[deepest], axis=1) < NEAR_MM
                in_the_way.append(line[is_blocked, deepest[is_blocked]])
        found = [found[n] for n in random.permutation(len(found))[:COMPARED]]
        return found, random.permutation(np.concatenate(in_the_way))[:COMPARED]

    def _worth(self, bite: "Bite", wanted: Doubles, price: float) -> float:
        """Return what share of what is wanted a bite takes, less what it harms.

        price: of what uses up all that is allowed of anything.
        """
        assert self._operation is not None
        patient, harm, rows = self._operation.patient, self._harm(), bite.rows
        assert self.patient.hazards is not None
        nearest = self.patient.hazards.nearest
        gaps = nearest.sample(rows[:, 1:7].reshape(-1, 2, 3)) * UNIT_MM
        if (gaps - rows[:, 7:8]).min() < SPARED_MM:
            return 0.0
        before = patient.books.counts
        if patient.carve(rows, instrument_named(bite.name).taker) is None:
            return 0.0
        taken = np.count_nonzero(self.distance.sample(wanted) <= 0.0)
        wasted = (patient.books.counts - before) / FULL - taken
        harm = self._harm() - harm + WASTE * wasted / len(wanted)
        patient.undo()
        return float(taken / len(wanted) - price * harm)

    def _harm(self) -> float:
        """Return how much of what is allowed was used up; infinite for too much."""
        assert self.session.tasks is not None
        assert self._operation is not None
        taken = self._operation.patient.books.tissues() | self._operation.wall_mm3()
        harm = 0.0
        for task in self.scenario.tasks:
            if self.status(task) is Status.FAILED:
                return math.inf
            if isinstance(task, Remove):
                for name, limit in {**task.tissues, **task.walls}.items():
                    if limit.most_mm3:
                        used = taken.get(name, 0.0) / limit.most_mm3
                        harm += used if used < 1.0 else math.inf
        return math.inf if self._operation.injured else harm

    def _close(self, bite: "Bite") -> bool:
        """Make a bite; take it back where it does harm. Return whether it was made."""
        time_s, count, before = (
            self.time_s,
            len(self.samples),
            self.session.checkpoint(),
        )
        is_powered = instrument_named(bite.name).needs_suction
        for jaw in (bite.jaw, bite.jaw, 0.6, 1.0):
            is_down = jaw > bite.jaw
            state = InstrumentState(bite.name, bite.roll_deg, jaw, is_down, is_powered)
            self._step(bite.frame[:3, 3], -bite.frame[:3, 2], state)
        # drawn back: the way to the next bite leads through nothing
        self.stay(STEP_S)
        if not math.isinf(self._harm()):
            return True
        self.session.restore(before)
        self.time_s = time_s
        del self.samples[count:]
        return False

    def _wanted(self, task: Remove | Open) -> Doubles:
        """Return where there is what a task wants taken."""
        head = untouched(self.patient)
        if isinstance(task, Remove):
            # what later tasks ask for may lie in the way
            names = dict.fromkeys(
                name
                for each in self.scenario.tasks
                if isinstance(each, Remove)
                for name, share in each.parts.items()
                if share.least_percent
            )
            found = [head.part(name) for name in names]
            return np.concatenate(
                [head.places(part.voxels) for part in found if part is not None]
            )
        neck = Neck.between(head.distance, self.place(task.start), self.place(task.end))
        wide_mm = max(task.radius_mm, 1.15 * math.sqrt(task.area_mm2 / math.pi))
        is_near = np.linalg.norm(neck.points - neck.middle, axis=2) < wide_mm
        is_near &= np.isfinite(neck.behind_mm)
        near, behind_mm = neck.points[is_near][::4], neck.behind_mm[is_near][::4]
        depths = np.arange(-THROUGH_MM, behind_mm.max(), 0.5)
        walls = near[:, None] + depths[:, None] * neck.normal
        chosen: Doubles = walls[depths < behind_mm[:, None]]
        return chosen

    # places

    def _lines(self, tips: Doubles, but_mm: float) -> tuple[Doubles, Doubles, Doubles]:
        """Return each tip with the entry from which least tissue is on its way.

        The third: how deep the axis lies in tissue, mm, but for its last part.
        """
        entries = self._entries[:24]
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
            self._operation.take_injuries()


@dataclass(frozen=True)
class Bite:
    """A bite: tool, pose, and how wide its jaws are."""

    name: str
    frame: Doubles
    roll_deg: float
    jaw: float

    @property
    def rows(self) -> Doubles:
        """Return what it takes, as capsules in the world."""
        rows = _held(self.name, self.jaw).copy()
        rows[:, 1:4] = moved(rows[:, 1:4], self.frame)
        rows[:, 4:7] = moved(rows[:, 4:7], self.frame)
        return rows


@cache
def _held(name: str, jaw: float) -> Doubles:
    """Return what a tool takes, in its own frame; an edge at rest is capsules, too."""
    rows = instrument_named(name).working_volume(np.eye(4), jaw)
    is_edge = rows[:, 0] == BLADE
    rows[is_edge, 7] = rows[is_edge, 13]
    rows[:, 0] = CAPSULE
    return rows


def middle_of(off: Doubles) -> Doubles:
    """Return places along a tool's middle in its own frame; off: of its shaft."""
    bend = off + np.array([0.0, 0.0, np.linalg.norm(off)])
    share = np.linspace(0.0, 1.0, 8, endpoint=False)[:, None]
    back = np.zeros((TOOL_POINTS, 3))
    back[:, 2] = np.linspace(0.0, LONGEST_MM, TOOL_POINTS)
    return np.concatenate([share * bend, bend + back])


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
