"""What both hands feel of a patient: the scope, and the tool beside it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scenarios.instrument_state import NO_TOOL, InstrumentState
from scenarios.instruments.catalogue import Instrument, instrument_named, parts_of
from scenarios.scoring import BreakFigure
from surgery.force import NO_TOUCH, ForceState, JawContact, RigidPart, ToolForce, Touch
from surgery.patient import OperatedPatient
from surgery.solids import capsule

Doubles = NDArray[np.float64]

SHAFT_MM = 110.0
"""Length of the scope's shaft."""

SCOPE = "endoscope"
"""Name of the scope where injuries and breaks say what made them."""

BORE_MM = 2.0
"""Of what sucks, about: 1.6 mm of a straight tube, 2.2 mm of a curved one."""


@dataclass(frozen=True, slots=True)
class FeelingState:
    """What both hands feel at one moment, and the name of the tool."""

    name: str
    tool: ForceState | None
    scope: ForceState | None
    figures: "FeltFigures"


@dataclass(frozen=True, slots=True)
class FeltFigures:
    """Count what was felt: greatest forces in N, and what gave in to them."""

    tool_n: float = 0.0
    scope_n: float = 0.0
    breaks: tuple[BreakFigure, ...] = ()


@dataclass(slots=True)
class Feeling:
    """Follow scope and tool by recorded samples.

    tool, scope: their touch in the newest sample. figures: of all samples.
    """

    patient: OperatedPatient
    tool: Touch = NO_TOUCH
    scope: Touch = NO_TOUCH
    figures: FeltFigures = field(default_factory=FeltFigures)
    _name: str = NO_TOOL
    _tool: ToolForce | None = None
    _scope: ToolForce | None = None
    _radius_mm: float = 0.0

    def step(
        self,
        time_s: float,
        world_from_tip: Doubles,
        radius_mm: float,
        world_from_tool: Doubles,
        state: InstrumentState,
    ) -> None:
        """Take in one sample.

        world_from_tip: 4x4 of the scope, of radius_mm. world_from_tool: 4x4.
        """
        if self._scope is None:
            self._scope = self._scope_of(radius_mm)
        self.scope = self._scope.step(time_s, world_from_tip)
        if state.name != self._name:
            self._take(state.name)
        self.tool = NO_TOUCH
        held = self._tool
        if held is not None:
            self.tool = held.step(
                time_s,
                world_from_tool,
                state.jaw,
                state.is_sucking,
                held=state.is_carried,
                bites=state.is_carried and state.is_working and held.has_jaws,
            )
        told = self.figures
        self.figures = FeltFigures(
            max(told.tool_n, self.tool.size_n),
            max(told.scope_n, self.scope.size_n),
            told.breaks
            + _breaks(time_s, self.tool, state.name)
            + _breaks(time_s, self.scope, SCOPE),
        )

    def checkpoint(self) -> FeelingState:
        """Return all that later samples may change."""
        return FeelingState(
            self._name,
            None if self._tool is None else self._tool.checkpoint(),
            None if self._scope is None else self._scope.checkpoint(),
            self.figures,
        )

    def restore(self, state: FeelingState, radius_mm: float) -> None:
        """Go back, or on, to a state; radius_mm: of the scope."""
        self.figures = state.figures
        self._name = NO_TOOL
        self._tool, self.tool = None, NO_TOUCH
        self._scope, self.scope = None, NO_TOUCH
        if state.scope is not None:
            self._scope = self._scope_of(radius_mm)
            self._scope.restore(state.scope)
            self.scope = state.scope.touch
        if state.tool is not None:
            self._tool = tool_force(self.patient, instrument_named(state.name))
            self._tool.restore(state.tool)
            self.tool = state.tool.touch
        self._name = state.name

    def _take(self, name: str) -> None:
        """Take another tool into the hand: holes of the one before stay open."""
        before, self._tool, self._name = self._tool, None, name
        if name != NO_TOOL:
            self._tool = tool_force(self.patient, instrument_named(name))
            if before is not None:
                self._tool.inherit(before)

    def _scope_of(self, radius_mm: float) -> ToolForce:
        shaft = capsule([0, 0, radius_mm], [0, 0, SHAFT_MM], radius_mm)
        return ToolForce(self.patient, [RigidPart(shaft)])


def _breaks(time_s: float, touch: Touch, by: str) -> tuple[BreakFigure, ...]:
    return tuple(BreakFigure(time_s, wall, touch.size_n, by) for wall in touch.broken)


def tool_force(patient: OperatedPatient, tool: Instrument) -> ToolForce:
    """Return what follows a tool of the catalogue."""
    parts = [
        RigidPart(part.capsules.rows(), part.pose if part.open_deg else None)
        for part in parts_of(tool)
    ]
    bore_mm = BORE_MM if tool.suction_ml_s > 0 else 0.0
    return ToolForce(patient, parts, gape=gape_of(tool), bore_mm=bore_mm)


def gape_of(tool: Instrument) -> JawContact | None:
    """Return what lies between a tool's jaws; None for one without."""
    rows = tool.shape.bite(0.0)
    if len(rows) == 0:
        return None
    begin, end, radius = rows[:, 1:4], rows[:, 4:7], rows[:, 7]
    points = np.concatenate([begin, 0.5 * (begin + end), end])
    # from the farthest place that one jaw holds to the farthest of the other
    widest = max(
        float(np.linalg.norm(ends[:, None] - ends, axis=2).max())
        for ends in (begin, end)
    )
    return JawContact(points, widest + 2.0 * float(radius.max()))
