"""A hand without an arm: mouse and keyboard, a gamepad, a 3D mouse.

The scope pivots about the nostril's midpoint. The cone's axis runs to the
sphenoethmoidal recess, which lies in the middle of where a scope goes: from the
nasopharynx, 20 degrees below, to the frontal ostium, 38 degrees above.

Nothing pushes back on such a hand, so walls hold the scope where tissue would: it
slides along them.
"""

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices import ProbePath
from devices.controls.fulcrum import Fulcrum, FulcrumControl, FulcrumLimits
from devices.controls.gamepad import open_gamepad
from devices.controls.handover import Handover
from devices.controls.keyboard import MouseKeys
from devices.controls.steered_scope import ScopeController, SteeredArm
from paravol.inputs.asked_tissue import asked_tissue
from paravol.inputs.flight_input import FlightInput, framed_hand, in_the_patient
from paravol.inputs.nostril_lines import LeaningScope
from paravol.inputs.pointed_tool import PointedTool
from paravol.inputs.tool_hold import TOUCH_MM, ToolHold
from paravol.inputs.tool_plan import ToolPlan
from paravol.inputs.turns import SteeredTurns
from paravol.patient import PatientScene
from renderers.scene import Volume
from scenarios import Scenario
from scenarios.nostril import tool_pivot
from scenarios.scenario import Start
from scenarios.session import SHAFT_CHECKED_MM
from surgery.contact import ScopeHold
from system import UserError

LIMITS = FulcrumLimits(depth_mm=(0.0, 100.0), cone_deg=40.0)
"""The nasopharynx lies 81 mm behind the nostril; beyond 100 mm is the spine."""

DEEPEST_START_MM = 30.0
"""So deep a free place to begin is looked for."""

START = Start()
"""Before the right nostril."""

UPRIGHT_DEG = 6.0
"""Between the cone and the vertical, where a picture has no up."""


def nostril_fulcrum(
    patient: PatientScene,
    path: ProbePath | None = None,
    start: Start = START,
    side: str | None = None,
) -> Fulcrum:
    """Return the fulcrum of the nostril that the exercise's path enters.

    Without a path it is where the start says. side: "right" or "left" for that nostril.
    In a patient's own head, whose anatomy has no names, it is where the case says, and
    a side is refused.
    """
    if start.tip_mm is not None and start.axis is not None:
        return Fulcrum(np.array(start.tip_mm), np.array(start.axis))
    if patient.way_in is not None:
        if side is not None:
            raise UserError(
                "This case names one way in; leave out --instrument-side for it."
            )
        return Fulcrum(patient.way_in.pivot_mm, patient.way_in.axis)
    if side is None:
        side = start.nostril.value
        if path is not None:
            side = "right" if path.tip_mm[0, 0] < 0.0 else "left"
    nostril, recess = f"nostril, {side}", f"sphenoethmoidal recess, {side}"
    place = patient.positions((nostril, recess))
    return Fulcrum(place[nostril], place[recess] - place[nostril])


def scope_control(
    patient: PatientScene,
    path: ProbePath | None,
    radius_mm: float,
    start: Start = START,
) -> FulcrumControl:
    """Return what moves a scope in the nostril, held by the walls as they are then."""
    fulcrum = nostril_fulcrum(patient, path, start)
    fulcrum = begun_in_air(patient.surface.distance, fulcrum, radius_mm)
    hold = ScopeHold(
        patient.surface.distance,
        radius_mm,
        SHAFT_CHECKED_MM,
        fulcrum.pivot_mm,
        TOUCH_MM,
    )
    lean = None
    if patient.face is not None:
        # a space to practise in has no nostril that yields
        lean = LeaningScope(fulcrum, patient.surface.distance, radius_mm)
    return FulcrumControl(fulcrum, limits_about(fulcrum), hold=hold, lean=lean)


def begun_in_air(distance: Volume, fulcrum: Fulcrum, radius_mm: float) -> Fulcrum:
    """Return the fulcrum at the first place of its axis with room for a scope.

    The widest place where there is none: a way into a patient's own head may begin in
    a wall.
    """
    depths = np.arange(0.0, DEEPEST_START_MM, 0.5)
    places = fulcrum.pivot_mm + depths[:, None] * fulcrum.axis
    # the round end of a scope has its middle behind the tip
    air = -np.asarray(distance.sample(places - radius_mm * fulcrum.axis))
    is_free = air >= radius_mm
    best = int(np.argmax(is_free)) if is_free.any() else int(np.argmax(air))
    return replace(fulcrum, pivot_mm=places[best]) if best else fulcrum


def tool_control(
    patient: PatientScene,
    path: ProbePath | None,
    start: Start = START,
    side: str | None = None,
) -> tuple[FulcrumControl, ToolHold]:
    """Return what moves a tool's shaft in the nostril, beside the scope; its walls.

    side: of the nostril, "right" or "left"; None for that of the exercise.
    """
    scope = nostril_fulcrum(patient, path, start, side)
    fulcrum = Fulcrum(tool_pivot(scope.pivot_mm, scope.axis), scope.axis)
    distance = patient.surface.distance
    hold = ToolHold(distance, fulcrum.pivot_mm, patient.hazards, patient.layers)
    return FulcrumControl(fulcrum, limits_about(fulcrum), hold=hold), hold


def pointed_tool(
    patient: PatientScene,
    distance: Volume,
    path: ProbePath | None,
    scenario: Scenario,
) -> PointedTool | None:
    """Return a tool that goes where somebody points; None where no nostril is known.

    distance: signed air distance of the tissue that holds it, mm.
    """
    try:
        fulcrum = nostril_fulcrum(patient, path, scenario.start)
    except UserError:
        return None
    hold = ToolHold(distance, fulcrum.pivot_mm, patient.hazards, patient.layers)
    asked = asked_tissue(patient, scenario.tasks)
    labels = None if asked is None else asked.labels
    plan = ToolPlan(fulcrum, distance, labels, patient.hazards, patient.layers)
    pointed = PointedTool(fulcrum, hold, distance, plan)
    if asked is not None:
        pointed.ask = asked.ask
    return pointed


def limits_about(fulcrum: Fulcrum) -> FulcrumLimits:
    """Return how far a shaft goes in a nostril.

    A steep way in leaves less room for a cone that must not reach the vertical.
    """
    aside_deg = math.degrees(math.acos(min(abs(float(fulcrum.axis[2])), 1.0)))
    return replace(LIMITS, cone_deg=min(LIMITS.cone_deg, aside_deg - UPRIGHT_DEG))


class _HandInput(FlightInput):
    """Steer a scope in the nostril."""

    may_skip = can_lay = True

    def __init__(
        self,
        scenario: Scenario,
        path: ProbePath | None,
        handset: ScopeController | None,
    ) -> None:
        self._radius_mm = scenario.scope.endoscope().diameter_mm / 2
        self._path, self._start = path, scenario.start
        self._handset = handset
        self._handover = Handover()
        self._control: FulcrumControl | None = None
        self.completer = framed_hand()
        self.registration = in_the_patient()

    @property
    def is_wedged(self) -> bool:
        """Return whether walls hold the scope, whatever is asked for."""
        return self._control is not None and self._control.is_wedged

    @property
    def is_laid(self) -> bool:
        """Return whether the scope is on its way to where it was told to lie."""
        return self._control is not None and self._control.is_laid

    def go_out(self) -> None:
        """Take the scope back outside."""
        if self._control is not None:
            self._control.go_out()

    def lay(
        self,
        frame: NDArray[np.float64],
        entry_mm: NDArray[np.float64],
        drawn_mm: float,
    ) -> None:
        """Bring the scope to a frame; see `FulcrumControl.lay`."""
        if self._control is not None:
            self._control.lay(frame, entry_mm, drawn_mm)

    def open(self, patient: PatientScene) -> AbstractContextManager[SteeredArm]:
        """Put the scope's tip into the nostril."""
        control = scope_control(patient, self._path, self._radius_mm, self._start)
        self._control = control
        if not self.is_held_by_walls:
            control.go_through_walls()
        if self._handset is None:
            return SteeredArm(control, self._handover.scope)
        self.turns = turns = SteeredTurns(
            self._handover, *tool_control(patient, self._path, self._start)
        )
        return SteeredArm(
            control,
            self._handover.scope,
            self._handset,
            events=self._handover,
            is_still=lambda: turns.is_tools,
        )

    def on_swap(self, heard: Callable[[], object]) -> None:
        """Let a gamepad's button ask for the tool, or for the scope."""
        self._handover.on_swap = heard


class MouseInput(_HandInput):
    """Steer with keys and mouse; the window passes them on to ``controls``."""

    def __init__(self, scenario: Scenario, path: ProbePath | None) -> None:
        super().__init__(scenario, path, None)
        self.name = "mouse and keyboard"
        self.controls = MouseKeys(self._handover)


class GamepadInput(_HandInput):
    """Steer with the first gamepad or 3D mouse, or with the one at ``file``.

    number: of the gamepad, where there is no file.
    """

    def __init__(
        self,
        scenario: Scenario,
        path: ProbePath | None,
        file: Path | None,
        number: int = 1,
    ) -> None:
        pad = open_gamepad(file, number)
        super().__init__(scenario, path, pad)
        self.name = pad.name
        self.keys = pad.layout.help
        self.rumble = pad.rumble
