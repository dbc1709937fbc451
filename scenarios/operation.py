"""Operate on a patient by recorded samples.

Everything follows from the samples: the same ones leave the same patient, whatever
machine steps them and however fast.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from renderers.scene import Change, ChangeKind, Volume
from scenarios.endoscope import Endoscope
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments.catalogue import Action, Instrument, instrument_named
from scenarios.sample import Sample, tool_frame
from scenarios.scoring import InjuryFigure, OperationFigures
from surgery.edit import Edit
from surgery.film import BloodFilm, Suction
from surgery.injury import Injury, InjuryWatch
from surgery.lens import Lens
from surgery.patient import OperatedPatient
from surgery.solids import ROUGH, SEED, Rows, capsule

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

FASTEST_MM_S = 2000.0
"""Nothing is cut on a faster way: no hand moves so, a device was moved or lost."""

SCOPE = "endoscope"
"""Name of the scope where injuries say what made them."""

ABSENT_S = 0.25
"""Nothing is cut on a way between samples farther apart than this."""


@dataclass(slots=True)
class _Cutting:
    """Hold a sweep: where it was last cut, where last seen and when, its stroke."""

    cut: NDArray[np.float64]
    seen: NDArray[np.float64]
    seen_s: float
    stroke: int

    def leads_to(self, frame: NDArray[np.float64], time_s: float) -> bool:
        """Return whether a hand may have come here by the straight way."""
        elapsed_s = time_s - self.seen_s
        moved_mm = float(np.linalg.norm(frame[:3, 3] - self.seen[:3, 3]))
        return elapsed_s <= ABSENT_S and moved_mm <= FASTEST_MM_S * elapsed_s


@dataclass(slots=True)
class Operation:
    """Turn samples into edits of a patient.

    patient: is edited. film: its blood. injuries: watches what must not be hurt; None
    where nobody knows where that is. lens: of the scope, from the first sample on.
    edits, changes: what came of the samples since somebody last took them; hurt:
    likewise the injuries.
    """

    patient: OperatedPatient
    film: BloodFilm
    injuries: InjuryWatch | None = None
    lens: Lens | None = None
    edits: list[Edit] = field(default_factory=list)
    changes: list[Change] = field(default_factory=list)
    hurt: list[Injury] = field(default_factory=list)
    _strokes: int = 0
    _undone: int = 0
    _washed: int = 0
    _widest: float = 1.0
    _cutting: _Cutting | None = None

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
        return cls(patient, film, watch)

    def step(
        self,
        sample: Sample,
        world_from_tip: NDArray[np.float64],
        endoscope: Endoscope,
    ) -> None:
        """Take in one sample; they must come in order of time.

        world_from_tip: 4x4 pose of the scope in the patient.
        """
        state = sample.instrument
        for _ in range(self._undone, state.undone):
            change = self.patient.undo()
            if change is not None:
                self.changes.append(change)
                self.film.after_edit(change)
        self._undone = max(self._undone, state.undone)
        self._watch(sample, world_from_tip, endoscope)
        self._operate(sample)
        self._bleed(sample)
        self._soil(sample, world_from_tip, endoscope)

    def _operate(self, sample: Sample) -> None:
        """Let the tool take what it takes."""
        state = sample.instrument
        if state.name == NO_TOOL:
            self._rest()
            return
        tool = instrument_named(state.name)
        frame = tool_frame(sample)
        if not np.all(np.isfinite(frame)):
            self._rest()
        elif tool.action is Action.BITE:
            self._bite(tool, frame, sample)
        elif tool.action in (Action.POWERED, Action.SCRAPE, Action.CUT):
            self._sweep(tool, frame, sample)
        else:
            self._rest()

    def take_changes(self) -> list[Change]:
        """Return the changes since the last call."""
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

    def figures(self) -> OperationFigures:
        """Return what the operation came to so far."""
        books, film = self.patient.books, self.film.books
        hurt = () if self.injuries is None else self.injuries.injuries
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
        )

    def _watch(
        self,
        sample: Sample,
        world_from_tip: NDArray[np.float64],
        endoscope: Endoscope,
    ) -> None:
        """Follow scope and tool past what must not be hurt."""
        watch = self.injuries
        if watch is None:
            return
        radius = endoscope.diameter_mm / 2
        tip, back = world_from_tip[:3, 3], world_from_tip[:3, 2]
        if np.all(np.isfinite(world_from_tip)):
            scope = capsule(tip + radius * back, tip + SHAFT_MM * back, radius)
            self.hurt += watch.move(SCOPE, sample.time_s, scope)
        else:
            watch.leave(SCOPE)
        state, frame = sample.instrument, tool_frame(sample)
        if state.name == NO_TOOL:
            return
        if not np.all(np.isfinite(frame)):
            watch.leave(state.name)
            return
        tool = instrument_named(state.name).capsules(frame, state.jaw)
        self.hurt += watch.move(state.name, sample.time_s, tool.rows())

    def _bleed(self, sample: Sample) -> None:
        """Let blood run up to now, and be sucked where the tool sucks."""
        state, suction = sample.instrument, None
        if state.is_sucking and state.name != NO_TOOL:
            tool = instrument_named(state.name)
            if tool.suction_ml_s > 0:
                middle, radius = tool.tip_ball(tool_frame(sample))
                flow = 60.0 * tool.suction_ml_s
                suction = Suction(middle, radius + SUCKED_MM, flow)
        self.film.suck(suction)
        self.film.advance(sample.time_s)
        box = self.film.drawn_box()
        if box is not None:
            self.patient.generation += 1
            self.changes.append(Change(self.patient.generation, *box, ChangeKind.FILM))

    def _soil(
        self,
        sample: Sample,
        world_from_tip: NDArray[np.float64],
        endoscope: Endoscope,
    ) -> None:
        """Let the lens get dirty by what it touches, and be washed."""
        if self.lens is None:
            self.lens = Lens(self.patient.surface, endoscope.diameter_mm / 2)
        washed = sample.instrument.washed
        if washed > self._washed:
            self._washed = washed
            self.lens.wash()
        self.lens.advance(sample.time_s, world_from_tip[:3, 3])

    def _rest(self) -> None:
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

    def _carve(
        self,
        tool: Instrument,
        rows: Rows,
        sample: Sample,
        stroke: int,
    ) -> None:
        if len(rows) == 0:
            return
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
            self.changes.append(edit.change)
            self.film.after_edit(edit.change)
            if self.injuries is not None:
                self.hurt += self.injuries.cut(edit, self.patient.surface.distance)
