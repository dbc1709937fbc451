"""Operate on a patient by recorded samples.

Everything follows from the samples: the same ones leave the same patient, whatever
machine steps them and however fast.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Change
from scenarios.endoscope import tip_frame
from scenarios.instrument_state import NO_TOOL, InstrumentState
from scenarios.sample import Sample
from surgery.edit import Edit
from surgery.patient import OperatedPatient
from surgery.working_part import Action, WorkingPart

CLOSED, OPEN = 0.9, 0.5
"""A bite is taken when the jaw closes beyond the first after it was open beyond the
second."""

SHORTEST_MM = 0.1
"""A blade cuts when it has moved so far since the last cut, or has just begun."""

FASTEST_MM_S = 2000.0
"""Nothing is cut on a faster way: no hand moves so, a device was moved or lost."""

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

    patient: is edited. part_of: the working part of an instrument, by its name.
    edits, changes: what came of the samples since somebody last took them.
    """

    patient: OperatedPatient
    part_of: Callable[[str], WorkingPart]
    edits: list[Edit] = field(default_factory=list)
    changes: list[Change] = field(default_factory=list)
    _strokes: int = 0
    _undone: int = 0
    _was_open: bool = True
    _cutting: _Cutting | None = None

    def step(self, sample: Sample) -> None:
        """Take in one sample; they must come in order of time."""
        state = sample.instrument
        for _ in range(self._undone, state.undone):
            change = self.patient.undo()
            if change is not None:
                self.changes.append(change)
        self._undone = max(self._undone, state.undone)
        if state.name == NO_TOOL:
            self._rest()
            return
        part = self.part_of(state.name)
        frame = tool_frame(sample)
        if not np.all(np.isfinite(frame)):
            self._rest()
            return
        if part.action is Action.BITE:
            self._bite(part, frame, sample)
        elif part.action is Action.SWEEP:
            self._sweep(part, frame, sample)
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

    def _rest(self) -> None:
        self._cutting = None
        self._was_open = True

    def _bite(
        self, part: WorkingPart, frame: NDArray[np.float64], sample: Sample
    ) -> None:
        self._cutting = None
        jaw = sample.instrument.jaw
        if self._was_open and jaw >= CLOSED:
            self._was_open = False
            self._strokes += 1
            rows = part.bite(frame, self._strokes)
            self._carve(part, rows, sample, self._strokes)
        elif jaw <= OPEN:
            self._was_open = True

    def _sweep(
        self, part: WorkingPart, frame: NDArray[np.float64], sample: Sample
    ) -> None:
        state = sample.instrument
        works = state.is_working and (state.is_sucking or not part.needs_suction)
        if not works:
            self._rest()
            return
        last = self._cutting
        if last is None or not last.leads_to(frame, sample.time_s):
            self._strokes += last is None
            self._cutting = _Cutting(frame, frame, sample.time_s, self._strokes)
            rows = part.sweep(frame, frame, self._strokes)
            self._carve(part, rows, sample, self._strokes)
            return
        last.seen, last.seen_s = frame, sample.time_s
        first, end = (part.edge @ f[:3, :3].T + f[:3, 3] for f in (last.cut, frame))
        if np.abs(end - first).max() < SHORTEST_MM:
            return
        rows = part.sweep(last.cut, frame, last.stroke)
        self._carve(part, rows, sample, last.stroke)
        last.cut = frame

    def _carve(
        self,
        part: WorkingPart,
        rows: NDArray[np.float64],
        sample: Sample,
        stroke: int,
    ) -> None:
        edit = self.patient.carve(
            rows,
            part.taker,
            time_s=sample.time_s,
            tool=sample.instrument.name,
            stroke=stroke,
        )
        if edit is not None:
            self.edits.append(edit)
            self.changes.append(edit.change)


def tool_frame(sample: Sample) -> NDArray[np.float64]:
    """Return ``world_from_instrument`` of a sample, 4x4, its roll included."""
    return rolled(
        tip_frame(sample.instrument_tip_mm, sample.instrument_pointing),
        sample.instrument,
    )


def rolled(frame: NDArray[np.float64], state: InstrumentState) -> NDArray[np.float64]:
    """Turn a tool's frame about its axis, right-handed about where it points."""
    if state.roll_deg == 0.0:
        return frame
    # +z runs back up the shaft: right-handed about -z
    angle = -np.radians(state.roll_deg)
    turned = frame.copy()
    turned[:3, 0] = np.cos(angle) * frame[:3, 0] + np.sin(angle) * frame[:3, 1]
    turned[:3, 1] = np.cos(angle) * frame[:3, 1] - np.sin(angle) * frame[:3, 0]
    return turned
