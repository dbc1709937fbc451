"""Operate on a patient by recorded samples.

Everything follows from the samples: the same ones leave the same patient, whatever
machine steps them and however fast.
"""

import math
from collections import Counter
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from renderers.scene import Change, ChangeKind, Volume
from scenarios.endoscope import Endoscope
from scenarios.feeling import SCOPE, Feeling, FeelingState
from scenarios.instrument_state import NO_TOOL, InstrumentState
from scenarios.instruments.catalogue import Action, Instrument, instrument_named
from scenarios.sample import Sample, tool_frame
from scenarios.scoring import InjuryFigure, OperationFigures
from surgery.edit import Edit
from surgery.film import BloodFilm, FilmState, Suction
from surgery.force import Touch, warm_up
from surgery.injection import Box, Injection, InjectionState
from surgery.injury import Injury, InjuryState, InjuryWatch
from surgery.lens import NOSE_C, Lens, LensCheckpoint
from surgery.patient import OperatedPatient, PatientState
from surgery.pushing import LONGEST_MM, Pushing, PushingState, ToolCapsule, widened
from surgery.solids import BLADE, CAPSULE, ROUGH, SEED, Rows, capsule
from surgery.straight_way import is_way

CLOSED, OPEN = 0.9, 0.5
"""A bite is taken when the jaw closes beyond the first after it was open beyond the
second. It takes what lay between the jaws where they were widest."""

SHAFT_MM = 110.0
"""Length of the scope's shaft that is followed: the whole nasal passage."""

SUCKED_MM = 1.5
"""So far around its tip a tool sucks."""

SHORTEST_MM = 0.1
"""A blade cuts when it has moved so far since the last cut, or has just begun."""

TIP_MM = 5.0
"""What a tool cuts with lies at most so far from its origin: a turn moves it."""

ABSENT_S = 0.25
"""Nothing is cut on a way between samples farther apart than this."""

SWEEPING = (Action.POWERED, Action.SCRAPE, Action.CUT)
"""What tools do that cut with a moving edge."""

SCRAPES_N = 0.15
"""Under less force a curette or an elevator slides over tissue: a guess. Mucosa gives
it back where it is dented by half a millimetre, three times as deep as by a touch."""

BURIED_MM = 1.0
"""An edge so deep is pressed, whatever is felt: nothing resists what appears inside."""

PUSHES_PER_S = 30
"""How often tissue is looked at for whether it gives way, of samples' time."""

THINNEST_MM, THICKEST_MM = 0.2, 4.0
"""Radii of the rods that tissue gives way to; others count as the nearest."""


@dataclass(slots=True)
class _Cutting:
    """A sweep: where it was last cut, where last seen and when, its stroke."""

    cut: NDArray[np.float64]
    seen: NDArray[np.float64]
    seen_s: float
    stroke: int

    def leads_to(self, frame: NDArray[np.float64], time_s: float) -> bool:
        """Return whether a hand may have come here by the straight way."""
        elapsed_s = time_s - self.seen_s
        moved_mm = float(np.linalg.norm(frame[:3, 3] - self.seen[:3, 3]))
        return elapsed_s <= ABSENT_S and is_way(moved_mm, elapsed_s)


@dataclass(frozen=True, slots=True)
class OperationState:
    """An operation between two samples: each part's state, and the hand's.

    hand: the values of `_HAND` by name.
    """

    patient: PatientState
    pushing: PushingState
    film: FilmState
    injection: InjectionState
    injuries: InjuryState | None
    lens: LensCheckpoint | None
    cutting: _Cutting | None
    feeling: FeelingState
    hand: dict[str, Any]


_HAND = "_strokes", "_undone", "_washed", "_widest", "_held", "_pushed", "_injecting_s"
"""What an operation knows of the hand, in fields whose values never change."""


@dataclass(slots=True)
class Operation:
    """Turn samples into edits of a patient.

    patient: is edited. pushing: how it is shown, bent by the tool. film: its blood.
    injection: what it was injected. feeling: what both hands feel. injuries: watches
    what must not be hurt; None where nobody knows where that is. lens: of the scope,
    from the first sample on.
    edits, changes: what came of the samples since somebody last took them, the changes
    of what is drawn; hurt: likewise the injuries.
    """

    patient: OperatedPatient
    pushing: Pushing
    film: BloodFilm
    feeling: Feeling
    injection: Injection
    injuries: InjuryWatch | None = None
    lens: Lens | None = None
    edits: list[Edit] = field(default_factory=list)
    changes: list[Change] = field(default_factory=list)
    hurt: list[Injury] = field(default_factory=list)
    _strokes: int = 0
    _undone: int = 0
    _washed: int = 0
    _widest: float = 1.0
    _held: str = NO_TOOL
    _cutting: _Cutting | None = None
    _pushed: int | None = None
    _injecting_s: float | None = None
    _unshown: list[Change] = field(default_factory=list)
    _bent: int = 0

    @classmethod
    def on(
        cls,
        patient: OperatedPatient,
        labels: Volume | None,
        hazards: HazardVolumes | None,
        blood_bias: float = 1.0,
    ) -> "Operation":
        """Begin to operate; labels: of the head, where there are any.

        blood_bias: factor on how it bleeds, see `BloodFilm`.
        """
        watch = None
        if hazards is not None:
            pristine = patient.pristine.distance
            watch = InjuryWatch(hazards, patient.layers, pristine)
        film = BloodFilm(
            patient.surface,
            patient.wounds_film,
            labels=labels,
            hazards=hazards,
            blood_bias=blood_bias,
        )
        warm_up(patient)
        injection = Injection(patient.surface.distance, patient.wounds_pale)
        return cls(patient, Pushing(patient), film, Feeling(patient), injection, watch)

    @property
    def touch(self) -> Touch:
        """Return what the tool's hand felt in the newest sample."""
        return self.feeling.tool

    @property
    def scope_touch(self) -> Touch:
        """Return what the scope's hand felt in the newest sample."""
        return self.feeling.scope

    def step(
        self,
        sample: Sample,
        world_from_tip: NDArray[np.float64],
        endoscope: Endoscope,
    ) -> None:
        """Take in one sample; they must come in order of time.

        world_from_tip: 4x4 pose of the scope in the patient.
        """
        state, frame = sample.instrument, tool_frame(sample)
        for _ in range(self._undone, state.undone):
            change = self.patient.undo()
            if change is not None:
                self._edited(change)
                self.film.after_edit(change)
        self._undone = max(self._undone, state.undone)
        self._watch(sample, frame, world_from_tip, endoscope)
        # before it is cut: tissue resists, then gives in
        self.feeling.step(
            sample.time_s,
            world_from_tip,
            endoscope.diameter_mm / 2,
            frame,
            state,
        )
        self._operate(sample, frame)
        self._push(sample, frame)
        self._bleed(sample, frame)
        self._soil(sample, world_from_tip, endoscope)

    def pause(self, time_s: float) -> None:
        """Let nothing happen up to a sample's time: the trainer is frozen."""
        self._rest()
        self.film.skip(time_s)
        if self.lens is not None:
            self.lens.skip(time_s)
        if self.injuries is not None:
            self.injuries.leave(SCOPE)
            self.injuries.leave(self._held)

    def checkpoint(self) -> OperationState:
        """Return all that later samples may change; to be called between samples."""
        return OperationState(
            self.patient.checkpoint(),
            self.pushing.checkpoint(),
            self.film.checkpoint(),
            self.injection.checkpoint(),
            None if self.injuries is None else self.injuries.checkpoint(),
            None if self.lens is None else self.lens.checkpoint(),
            None if self._cutting is None else replace(self._cutting),
            self.feeling.checkpoint(),
            {name: getattr(self, name) for name in _HAND},
        )

    def restore(self, state: OperationState, endoscope: Endoscope) -> None:
        """Go back, or on, to a state of this operation; the changes say where it shows.

        Edits and injuries that nobody took are forgotten.
        """
        change = self.patient.restore(state.patient)
        if change is not None:
            self._edited(change)
        self.pushing.restore(state.pushing)
        self.patient.generation += 1
        self._bent = self.patient.generation
        self.film.restore(state.film)
        self._draw_film()
        self._draw_pallor(self.injection.restore(state.injection))
        if self.injuries is not None and state.injuries is not None:
            self.injuries.restore(state.injuries)
        self.lens = None
        if state.lens is not None:
            self.lens = self._lens_of(endoscope)
            self.lens.restore(state.lens)
        self._cutting = None if state.cutting is None else replace(state.cutting)
        self.feeling.restore(state.feeling, endoscope.diameter_mm / 2)
        for name, value in state.hand.items():
            setattr(self, name, value)
        self.edits, self.hurt = [], []

    def _lens_of(self, endoscope: Endoscope) -> Lens:
        radius_mm = endoscope.diameter_mm / 2
        return Lens(self.patient.surface, radius_mm, NOSE_C)

    def _operate(self, sample: Sample, frame: NDArray[np.float64]) -> None:
        """Let the tool take what it takes; frame: 4x4 of the tool."""
        state = sample.instrument
        if state.name == NO_TOOL:
            self._rest()
            return
        tool = instrument_named(state.name)
        if not np.isfinite(frame).all():
            self._rest()
        elif tool.action is Action.BITE:
            self._bite(tool, frame, sample)
        elif tool.action in SWEEPING:
            self._sweep(tool, frame, sample)
        elif tool.action is Action.INJECT:
            self._inject(frame, sample)
        else:
            self._rest()

    def show(self) -> None:
        """Let what is drawn be what the samples so far have made of the patient.

        Samples change nothing that is drawn: it may be drawn while they come in.
        `take_changes` tells where it is otherwise.
        """
        unshown, self._unshown = self._unshown, []
        cuts = [change for change in unshown if change.kind is ChangeKind.CUT]
        shown = [change for change in unshown if change.kind is not ChangeKind.CUT]
        self.pushing.show_blood(shown)
        kind = ChangeKind.CUT if cuts else ChangeKind.DENT
        bent = self.pushing.show(self._bent, kind)
        if cuts:
            bent = reduce(widened, cuts, bent or cuts[0])
        if bent is not None:
            shown.append(replace(bent, generation=self._bent))
        self.changes += sorted(shown, key=lambda change: change.generation)

    def take_changes(self) -> list[Change]:
        """Return the changes of what is drawn since the last call; see `show`."""
        self.show()
        taken, self.changes = self.changes, []
        return taken

    def take_edits(self) -> list[Edit]:
        """Return the edits since the last call."""
        taken, self.edits = self.edits, []
        return taken

    def take_injuries(self) -> list[Injury]:
        """Return the injuries since the last call."""
        taken, self.hurt = self.hurt, []
        return taken

    @property
    def cuts(self) -> int:
        """Return the number of cuts so far, their undoing counted too."""
        return self.patient.edits + self._undone

    @property
    def injured(self) -> frozenset[str]:
        """Return the names of the structures that were hurt."""
        hurt = () if self.injuries is None else self.injuries.injuries
        return frozenset(injury.structure for injury in hurt)

    def would_take(self, sample: Sample, now: Sample | None = None) -> dict[str, float]:
        """Return what the tool would take where a sample has it, mm3 by tissue.

        That is what open jaws take when they close, and what an edge takes on its way
        there from where it is now.
        """
        state, frame = sample.instrument, tool_frame(sample)
        if state.name == NO_TOOL or not np.isfinite(frame).all():
            return {}
        tool = instrument_named(state.name)
        if tool.action is Action.BITE:
            if state.jaw > OPEN:
                return {}
        elif tool.action not in SWEEPING:
            return {}
        before = None if now is None else tool_frame(now)
        rows = self._at_rest(tool.working_volume(frame, state.jaw, before))
        return self.patient.would_take(rows, tool.taker) if len(rows) else {}

    def wall_mm3(self) -> dict[str, float]:
        """Return the bone of walls that was taken, mm3, by name."""
        return self.patient.books.walls(self.patient.layers.kinds)

    def figures(self) -> OperationFigures:
        """Return what the operation came to so far."""
        books, film = self.patient.books, self.film.books
        hurt = () if self.injuries is None else self.injuries.injuries
        felt = self.feeling.figures
        return OperationFigures(
            self.patient.edits,
            books.tissues(),
            books.walls(self.patient.layers.kinds),
            books.mm3(books.pieces),
            film.bled_ml,
            film.sucked_ml,
            [
                InjuryFigure(
                    injury.time_s,
                    injury.structure,
                    injury.wall,
                    injury.side,
                    injury.place_mm.tolist(),
                    injury.depth_mm,
                    injury.by,
                )
                for injury in hurt
            ],
            0 if self.lens is None else self.lens.washes,
            0.0 if self.lens is None else self.lens.touches_s,
            felt.tool_n,
            felt.scope_n,
            dict(Counter(each.wall or "bone" for each in felt.breaks)),
            self.injection.ml,
            list(felt.breaks),
        )

    def _watch(
        self,
        sample: Sample,
        frame: NDArray[np.float64],
        world_from_tip: NDArray[np.float64],
        endoscope: Endoscope,
    ) -> None:
        """Follow scope and tool past what must not be hurt."""
        watch = self.injuries
        if watch is None:
            return
        radius = endoscope.diameter_mm / 2
        tip, back = world_from_tip[:3, 3], world_from_tip[:3, 2]
        if np.isfinite(world_from_tip).all():
            scope = capsule(tip + radius * back, tip + SHAFT_MM * back, radius)
            self.hurt += watch.move(SCOPE, sample.time_s, scope)
        else:
            watch.leave(SCOPE)
        state = sample.instrument
        if state.name != self._held:
            watch.leave(self._held)
            self._held = state.name
        if state.name == NO_TOOL:
            return
        if not np.isfinite(frame).all():
            watch.leave(state.name)
            return
        tool = instrument_named(state.name).capsules(frame, state.jaw)
        self.hurt += watch.move(state.name, sample.time_s, tool.rows())

    def _bleed(self, sample: Sample, frame: NDArray[np.float64]) -> None:
        """Let blood run up to now, and be sucked where the tool sucks."""
        state, suction = sample.instrument, None
        if state.is_sucking and state.name != NO_TOOL:
            tool = instrument_named(state.name)
            if tool.suction_ml_s > 0:
                middle, radius = tool.tip_ball(frame)
                # blood lies where the tissue under it does at rest
                middle = self.pushing.at_rest(middle[None], is_dented=False)[0]
                flow = 60.0 * tool.suction_ml_s
                suction = Suction(middle, radius + SUCKED_MM, flow)
        self.film.suck(suction)
        self.film.advance(sample.time_s)
        self._draw_film()

    def _draw_film(self) -> None:
        """Tell where the film was drawn anew."""
        box = self.film.drawn_box()
        if box is not None:
            self.patient.generation += 1
            self._unshown.append(Change(self.patient.generation, *box, ChangeKind.FILM))

    def _soil(
        self,
        sample: Sample,
        world_from_tip: NDArray[np.float64],
        endoscope: Endoscope,
    ) -> None:
        """Let the lens get dirty by what it touches, and be washed."""
        if self.lens is None:
            self.lens = self._lens_of(endoscope)
        washed = sample.instrument.washed
        if washed > self._washed:
            self._washed = washed
            self.lens.wash()
        if not np.isfinite(world_from_tip).all():
            self.lens.advance(sample.time_s, np.full((4, 3), np.nan), 0.0)
            return
        straight = endoscope.at(0.0)
        eye = straight.frame(world_from_tip, 0.0, sample.camera_roll_deg)
        touch, force_n = self.scope_touch, 0.0
        if touch.place_mm is not None:
            # what presses on the shaft farther up does not press on the lens
            away_mm = np.linalg.norm(touch.place_mm - eye[0])
            force_n = touch.size_n if away_mm <= endoscope.diameter_mm else 0.0
        self.lens.advance(sample.time_s, eye, force_n)

    def _push(self, sample: Sample, frame: NDArray[np.float64]) -> None:
        """Let tissue give way to the tool, or spring back, `PUSHES_PER_S` at most."""
        now = math.floor(sample.time_s * PUSHES_PER_S)
        if self._pushed is not None and now <= self._pushed:
            return
        self._pushed = now
        if self.pushing.take_in(sample.time_s, _rod(sample.instrument, frame)):
            self.patient.generation += 1
            self._bent = self.patient.generation

    def _edited(self, change: Change) -> None:
        """Take in an edit of the patient."""
        self._unshown.append(change)
        self._bent = change.generation
        self.pushing.take_in_edit(change)

    def _inject(self, frame: NDArray[np.float64], sample: Sample) -> None:
        """Let fluid flow from the needle's point while its pedal is down."""
        last_s = self._injecting_s
        self._rest()
        if not sample.instrument.is_working:
            return
        self._injecting_s = sample.time_s
        if last_s is None or sample.time_s - last_s > ABSENT_S:
            return
        place = self.pushing.at_rest(frame[None, :3, 3], is_dented=False)[0]
        self._draw_pallor(self.injection.inject(place, sample.time_s - last_s))

    def _draw_pallor(self, box: Box | None) -> None:
        """Tell where mucosa has another colour."""
        if box is not None:
            self.patient.generation += 1
            self._unshown.append(Change(self.patient.generation, *box, ChangeKind.TINT))

    def _rest(self) -> None:
        self._injecting_s = None
        self._cutting = None
        self._widest = 1.0

    def _bite(
        self, tool: Instrument, frame: NDArray[np.float64], sample: Sample
    ) -> None:
        self._cutting = None
        jaw = sample.instrument.jaw
        if jaw >= CLOSED and self._widest <= OPEN:
            rows = tool.working_volume(frame, self._widest)
            self._widest = 1.0
            self._strokes += 1
            self._carve(tool, rows, sample, self._strokes)
        elif sample.instrument.is_carried and not sample.instrument.is_working:
            # walls keep the jaws of a pointed tool closed, and open them again
            self._widest = jaw
        elif jaw < CLOSED:
            self._widest = min(self._widest, jaw)

    def _sweep(
        self, tool: Instrument, frame: NDArray[np.float64], sample: Sample
    ) -> None:
        state = sample.instrument
        if not state.is_working or (tool.needs_suction and not state.is_sucking):
            self._rest()
            return
        last = self._cutting
        if tool.action is Action.SCRAPE and not self._is_pressed(tool, frame):
            # lifted, or merely laid on: the stroke goes on where it is pressed again
            if last is not None:
                last.cut = last.seen = frame
                last.seen_s = sample.time_s
            return
        if last is None or not last.leads_to(frame, sample.time_s):
            self._strokes += last is None
            self._cutting = _Cutting(frame, frame, sample.time_s, self._strokes)
            rows = tool.working_volume(frame)
            self._carve(tool, rows, sample, self._strokes)
            return
        last.seen, last.seen_s = frame, sample.time_s
        moved_mm = np.linalg.norm(frame[:3, 3] - last.cut[:3, 3])
        turned = np.abs(frame[:3, :3] - last.cut[:3, :3]).max()
        if moved_mm + turned * TIP_MM < SHORTEST_MM:
            return
        rows = tool.working_volume(frame, before=last.cut)
        self._carve(tool, rows, sample, last.stroke)
        last.cut = frame

    def _is_pressed(self, tool: Instrument, frame: NDArray[np.float64]) -> bool:
        """Return whether an edge that scrapes is pressed onto tissue."""
        if self.feeling.tool.size_n >= SCRAPES_N:
            return True
        corners, radius = tool.shape.edge()
        places = corners @ frame[:3, :3].T + frame[:3, 3]
        depths = self.patient.surface.distance.sample(places)
        return bool(len(depths)) and float(depths.max()) + radius >= BURIED_MM

    def _at_rest(self, rows: Rows) -> Rows:
        """Bring a tool's solids to where what they take lies at rest; in place.

        Tissue went along with the tool. A dent is not looked at: what yields to a tool
        is what it takes.
        """
        for kind, points in ((CAPSULE, 2), (BLADE, 4)):
            chosen = rows[:, 0] == kind
            ends = rows[chosen, 1 : 1 + 3 * points].reshape(-1, 3)
            rest = self.pushing.at_rest(ends, is_dented=False)
            rows[chosen, 1 : 1 + 3 * points] = rest.reshape(-1, 3 * points)
        return rows

    def _carve(
        self,
        tool: Instrument,
        rows: Rows,
        sample: Sample,
        stroke: int,
    ) -> None:
        if len(rows) == 0:
            return
        self._at_rest(rows)
        rows[:, ROUGH], rows[:, SEED] = tool.rough_mm, stroke
        edit = self.patient.carve(
            rows,
            tool.taker,
            time_s=sample.time_s,
            tool=tool.name,
            stroke=stroke,
        )
        if edit is not None:
            self.edits.append(edit)
            self._edited(edit.change)
            self.film.after_edit(edit.change)
            if self.injuries is not None:
                self.hurt += self.injuries.cut(edit, self.patient.surface.distance)


def _rod(state: InstrumentState, frame: NDArray[np.float64]) -> ToolCapsule | None:
    """Return what tissue gives way to; None without a tool, or where it takes tissue.

    A tool that sweeps would otherwise push away what it is about to cut.
    """
    if state.name == NO_TOOL or not np.isfinite(frame).all():
        return None
    tool = instrument_named(state.name)
    if tool.action in SWEEPING and state.is_working:
        return None
    end = tool.end(frame, LONGEST_MM)
    places = np.concatenate([end.start_mm, end.end_mm[-1:]])
    return ToolCapsule.along(places, np.clip(end.radius_mm, THINNEST_MM, THICKEST_MM))
