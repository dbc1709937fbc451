"""One flight through a scenario, stepped by poses.

A session asks no clock, opens no device and draws nothing. The same samples give the
same cameras and the same score, which is what makes a replay a check.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from devices.cross import dot
from renderers.scene import Camera, Volume
from renderers.scene.lens_state import CLEAN
from scenarios.clearance import Clearance, shaft_clearance, tool_clearance
from scenarios.coverage import CoverageState, CoverageWatch, SeenPercent
from scenarios.endoscope import Endoscope
from scenarios.hazard_watch import HazardGaps, hazard_gaps
from scenarios.instrument_state import FIRST_TOOL, NO_TOOL
from scenarios.instruments.contact_shape import (
    CARRIED_MM,
    CHECKED_MM,
    contact_table,
    placed_table,
    shaft_mm,
)
from scenarios.nostril import SCOPE, TOOL, Nostrils, drag_mm
from scenarios.reading import Reading
from scenarios.sample import Sample, tool_frame
from scenarios.scoring import CONTACT_MM, Score, Scorer
from scenarios.structures import TISSUE, Structures
from scenarios.tasks import Situation, TaskEngine, TaskEvent
from scenarios.tasks.engine import EngineState

if TYPE_CHECKING:
    # what edits a patient loads a compiler
    from scenarios.operation import Operation, OperationState

SHAFT_CHECKED_MM = 110.0
"""Length of shaft that is kept clear of tissue: the whole nasal passage (the
nasopharynx lies about 90 mm behind the nostril)."""


@dataclass(frozen=True, slots=True)
class FrameState:
    """What a sample means in the patient: the camera, the tools, the gap.

    touched: the structure in contact with the shaft, "" without contact. hazard: the
    nearest hazard and how near scope or tool is, mm; None where none is known.
    instrument: name of the tool beside the scope, `NO_TOOL` for none. jaw: 0 open to 1
    closed. tool_mm: gap between that tool and tissue, None without a tool;
    tool_touched: what it touches without working, "" for nothing. drags_mm: how far
    "scope" and "tool" are off their places in the nostril; none that is in no nostril.
    scope_deg: angle of the scope that sees it.
    """

    camera: Camera
    world_from_tip: NDArray[np.float64]
    world_from_instrument: NDArray[np.float64]
    clearance_mm: float
    touched: str = ""
    hazard: tuple[str, float] | None = None
    instrument: str = FIRST_TOOL
    jaw: float = 1.0
    tool_mm: float | None = None
    tool_touched: str = ""
    drags_mm: Mapping[str, float] = field(default_factory=dict)
    scope_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class ScopeReading:
    """Where a sample's scope is: 4x4 pose, gap in mm, what is touched or near.

    touched: "" without contact. hazards: None where nobody knows them. tool_mm,
    tool_touched, drags_mm: as in `FrameState`.
    """

    world_from_tip: NDArray[np.float64]
    gap_mm: float
    touched: str
    hazards: HazardGaps | None
    tool_mm: float | None
    tool_touched: str
    drags_mm: dict[str, float]


@dataclass(frozen=True, slots=True)
class SessionState:
    """A session between two samples; see `Session.checkpoint`."""

    scorer: Scorer
    stepped: tuple[Sample, ScopeReading] | None
    operation: "OperationState | None"
    tasks: EngineState | None
    clock: "_Clock"
    coverage: CoverageState | None


@dataclass(frozen=True, slots=True)
class _Clock:
    """The score's clock, s.

    score_s: what it shows. stood_s: so long it stood so far. last_s: the last sample's
    time, None before the first. is_frozen: of that sample.
    """

    score_s: float = 0.0
    stood_s: float = 0.0
    last_s: float | None = None
    is_frozen: bool = False

    def at(self, sample: Sample) -> "_Clock":
        """Return the clock at the next sample; it stands between two frozen ones."""
        time_s, stood_s = sample.time_s, self.stood_s
        if self.last_s is None:
            return _Clock(time_s, 0.0, time_s, sample.is_frozen)
        if self.is_frozen or sample.is_frozen:
            stood_s += time_s - self.last_s
        # rounding must not let it run backwards
        score_s = max(time_s - stood_s, self.score_s)
        return _Clock(score_s, stood_s, time_s, sample.is_frozen)


class Session:
    """Turn samples into views and a score."""

    def __init__(
        self,
        endoscope: Endoscope,
        world_from_device: NDArray[np.float64],
        distance: Volume,
        targets: dict[str, NDArray[np.float64]],
        size: tuple[int, int],
        structures: Structures | None = None,
        operation: "Operation | None" = None,
        hazards: HazardVolumes | None = None,
        tasks: TaskEngine | None = None,
        nostrils: Nostrils | None = None,
        coverage: CoverageWatch | None = None,
    ) -> None:
        """Start a flight.

        world_from_device: the registration, 4x4.
        distance: signed air distance of the head, mm, negative in air.
        targets: landmark positions to approach, world mm.
        size: ``(width, height)`` of the picture.
        structures: what names contacts; None where the head has no names.
        operation: what the second hand does to the patient; None where it only looks.
        hazards: what must not be hurt; None where nobody knows where that is.
        tasks: what the trainee is asked to do; None for nothing.
        nostrils: what the shafts pass through; None where that is unknown.
        coverage: watches what mucosa is seen; None where nobody asks.
        """
        self.endoscope = endoscope
        self.world_from_device = world_from_device
        self.size = size
        self._distance = distance
        self._structures = structures
        self._hazards = hazards
        self._nostrils = nostrils
        self.coverage = coverage
        self.operation = operation
        self.tasks = tasks
        self._task_events: list[TaskEvent] = []
        self._clock = _Clock()
        self._scorer = Scorer(targets)
        self._stepped: tuple[Sample, ScopeReading] | None = None

    @property
    def clock_s(self) -> float:
        """Return the score's clock: the last sample's time without what was frozen."""
        return self._clock.score_s

    @property
    def last_s(self) -> float:
        """Return the last sample's time, as recordings count it; 0 before the first."""
        return self._clock.last_s or 0.0

    def take_task_events(self) -> list[TaskEvent]:
        """Return what happened to tasks since the last call."""
        taken, self._task_events = self._task_events, []
        return taken

    def step(self, sample: Sample) -> None:
        """Take in one sample and score it, unless the trainer was frozen."""
        placed = self._placed(sample)
        self._clock = self._clock.at(sample)
        if sample.is_frozen:
            if self.operation is not None:
                self.operation.pause(sample.time_s)
            self._stepped = sample, placed
            return
        if self.operation is not None:
            self.operation.step(sample, placed.world_from_tip, self.endoscope)
        tip_mm = placed.world_from_tip[:3, 3]
        self._scorer.add(
            self.clock_s, tip_mm, placed.gap_mm, placed.touched, placed.hazards
        )
        depth_mm = 0.0
        if placed.tool_touched and placed.tool_mm is not None:
            depth_mm = CONTACT_MM - placed.tool_mm
        self._scorer.add_hands(
            self.clock_s, depth_mm, placed.tool_touched, placed.drags_mm
        )
        self._stepped = sample, placed
        self._watch_mucosa(sample, placed)
        if self.tasks is not None:
            situation = self._situation(sample, placed)
            self._task_events += self.tasks.step(situation)

    @property
    def placed(self) -> ScopeReading | None:
        """Return where the last sample's scope was; None before the first."""
        return None if self._stepped is None else self._stepped[1]

    @property
    def reading(self) -> Reading | None:
        """Return what was measured at the last sample; None before the first."""
        return None if self.placed is None else Reading.of(self.placed)

    def checkpoint(self) -> SessionState:
        """Return all that later samples may change, the patient's tissue included."""
        operation = None if self.operation is None else self.operation.checkpoint()
        tasks = None if self.tasks is None else self.tasks.checkpoint()
        coverage = None if self.coverage is None else self.coverage.checkpoint()
        return SessionState(
            self._scorer.copy(),
            self._stepped,
            operation,
            tasks,
            self._clock,
            coverage,
        )

    def restore(self, state: SessionState) -> None:
        """Go back, or on, to a state of this session."""
        self._scorer = state.scorer.copy()
        self._stepped = state.stepped
        self._clock = state.clock
        self._task_events = []
        if self.tasks is not None and state.tasks is not None:
            self.tasks.restore(state.tasks)
        if self.coverage is not None and state.coverage is not None:
            self.coverage.restore(state.coverage)
        if self.operation is not None and state.operation is not None:
            self.operation.restore(state.operation, self.endoscope)

    def view(self, sample: Sample, size: tuple[int, int] | None = None) -> FrameState:
        """Return the view of a sample without scoring it.

        size: ``(width, height)`` of the picture, None for the session's. Nothing that
        is scored depends on it.
        """
        placed = self._placed(sample)
        return FrameState(
            self._camera(sample, placed, size),
            placed.world_from_tip,
            tool_frame(sample),
            placed.gap_mm,
            placed.touched,
            None if placed.hazards is None else placed.hazards.nearest(),
            sample.instrument.name,
            sample.instrument.jaw,
            placed.tool_mm,
            placed.tool_touched,
            placed.drags_mm,
            self.endoscope.at(sample.scope_deg).angle_deg,
        )

    def _camera(
        self, sample: Sample, placed: ScopeReading, size: tuple[int, int] | None = None
    ) -> Camera:
        """Return what the scope of a sample sees."""
        scope = self.endoscope.at(sample.scope_deg)
        return scope.camera(
            placed.world_from_tip,
            sample.roll_deg,
            size or self.size,
            sample.camera_roll_deg,
        )

    def _watch_mucosa(self, sample: Sample, placed: ScopeReading) -> None:
        watch = self.coverage
        if watch is None or not watch.is_due(self.clock_s):
            return
        lens = CLEAN
        if self.operation is not None and self.operation.lens is not None:
            lens = self.operation.lens.state
        camera = self._camera(sample, placed)
        watch.step(self.clock_s, camera, self._distance, lens)

    def _situation(self, sample: Sample, placed: ScopeReading) -> Situation:
        """Return what a sample means to tasks."""
        camera = self._camera(sample, placed)
        hand = sample.instrument
        tool_tip = None
        if hand.name != NO_TOOL and np.isfinite(sample.instrument_tip_mm).all():
            tool_tip = sample.instrument_tip_mm
        gaps = {} if placed.hazards is None else placed.hazards.nearest_mm()
        now = Situation(
            self.clock_s,
            placed.world_from_tip[:3, 3],
            camera,
            self._distance,
            hand.name,
            tool_tip,
            hand.is_working,
            gaps,
        )
        if self.coverage is not None:
            now = replace(now, seen_percent=SeenPercent(self.coverage))
        operation = self.operation
        if operation is None:
            return now
        return replace(
            now,
            edits=operation.cuts,
            books=operation.patient.books,
            fill=operation.patient.fill,
            wall_mm3=operation.wall_mm3(),
            injured=operation.injured,
        )

    def _placed(self, sample: Sample) -> ScopeReading:
        """Return the tip's pose in the patient and the gap around the shaft."""
        if self._stepped is not None and self._stepped[0] is sample:
            # a frame shows the sample that was scored last
            return self._stepped[1]
        world_from_tip = self.world_from_device @ sample.device_from_tip
        clearance = shaft_clearance(
            self._distance,
            world_from_tip,
            self.endoscope.diameter_mm / 2,
            SHAFT_CHECKED_MM,
        )
        touched = self._touched(clearance)
        frame = tip_mm = None
        if sample.instrument.name != NO_TOOL:
            held = tool_frame(sample)
            frame = held if np.isfinite(held).all() else None
            tip_mm = held[:3, 3] if np.isfinite(held[:3, 3]).all() else None
        gaps = self._hazard_gaps(tip_mm, world_from_tip)
        tool = self._tool_clearance(sample, frame)
        # what works is meant to touch
        is_idle = tool is not None and not sample.instrument.is_working
        return ScopeReading(
            world_from_tip,
            clearance.gap_mm,
            touched,
            gaps,
            None if tool is None else tool.gap_mm,
            self._touched(tool) if tool is not None and is_idle else "",
            self._drags(sample, frame, world_from_tip),
        )

    def _touched(self, clearance: Clearance) -> str:
        """Name what a tool touches, "" without contact."""
        if not clearance.gap_mm < CONTACT_MM:
            return ""
        named = self._structures
        return TISSUE if named is None else named.touched(clearance)

    def _tool_clearance(
        self, sample: Sample, frame: NDArray[np.float64] | None
    ) -> Clearance | None:
        """Measure the gap around the tool beside the scope; None without one."""
        state = sample.instrument
        if frame is None:
            return None
        length_mm = CARRIED_MM if state.is_carried else CHECKED_MM
        table = contact_table(state.name, state.jaw, length_mm)
        return tool_clearance(self._distance, placed_table(table, frame))

    def _drags(
        self,
        sample: Sample,
        frame: NDArray[np.float64] | None,
        world_from_tip: NDArray[np.float64],
    ) -> dict[str, float]:
        """Return how far the shafts are off their places in the nostril, mm."""
        found: dict[str, float] = {}
        if self._nostrils is None:
            return found
        scope = drag_mm(
            self._nostrils.scope_mm, world_from_tip[:3, 3], world_from_tip[:3, 2]
        )
        if scope is not None and math.isfinite(scope):
            found[SCOPE] = scope
        state = sample.instrument
        if frame is None or state.is_carried:
            return found
        shaft = shaft_mm(state.name)
        at = frame[:3, 3] + [dot(row, shaft) for row in frame[:3, :3]]
        tool = drag_mm(self._nostrils.tool_mm, at, frame[:3, 2])
        if tool is not None:
            found[TOOL] = tool
        return found

    def _hazard_gaps(
        self, tip_mm: NDArray[np.float64] | None, world_from_tip: NDArray[np.float64]
    ) -> HazardGaps | None:
        if self._hazards is None:
            return None
        radius_mm = self.endoscope.diameter_mm / 2
        return hazard_gaps(
            self._hazards, world_from_tip, radius_mm, SHAFT_CHECKED_MM, tip_mm
        )

    def score(self) -> Score:
        """Return the score so far."""
        score = self._scorer.score()
        if self.tasks is not None:
            score = replace(score, tasks=list(self.tasks.ended()))
        if self.coverage is not None:
            score = replace(score, coverage=self.coverage.figures())
        if self.operation is None:
            return score
        return replace(score, operation=self.operation.figures())
