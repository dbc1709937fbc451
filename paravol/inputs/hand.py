"""A hand without an arm: mouse and keyboard, a gamepad, a 3D mouse.

The scope pivots about the nostril's midpoint. The cone's axis runs to the
sphenoethmoidal recess, which lies in the middle of where a scope goes: from the
nasopharynx, 20 degrees below, to the frontal ostium, 38 degrees above.

Nothing pushes back on such a hand, so walls hold the scope where tissue would: it
slides along them.
"""

import math
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

import numpy as np

from devices import ProbePath
from devices.controls.fulcrum import Fulcrum, FulcrumControl, FulcrumLimits
from devices.controls.gamepad import open_gamepad
from devices.controls.keyboard import HELP, MouseKeys
from devices.controls.steered_scope import Handset, SteeredArm
from devices.controls.steering import Steering
from paravol.inputs.flight_input import FlightInput, framed_hand, in_the_patient
from paravol.patient import PatientScene
from scenarios import Scenario
from scenarios.scenario import Start
from scenarios.session import SHAFT_CHECKED_MM
from surgery.contact import ScopeHold

LIMITS = FulcrumLimits(depth_mm=(0.0, 100.0), cone_deg=40.0)
"""The nasopharynx lies 81 mm behind the nostril; beyond 100 mm is the spine."""

START = Start()
"""Before the right nostril."""

UPRIGHT_DEG = 6.0
"""Between the cone and the vertical, where a picture has no up."""


TOUCH_MM = 0.15
"""How deep a touch dents a wall: mucosa yields, and a touch is to be seen and counted,
but it is no pressure (`scenarios.scoring.PRESSURE_MM`)."""


def nostril_fulcrum(
    patient: PatientScene, path: ProbePath | None = None, start: Start = START
) -> Fulcrum:
    """Return the fulcrum of the nostril that the exercise's path enters.

    Without a path, where its start says.

    In a patient's own head, whose anatomy has no names, it is where the case says.
    """
    if start.tip_mm is not None and start.axis is not None:
        return Fulcrum(np.array(start.tip_mm), np.array(start.axis))
    if patient.way_in is not None:
        return Fulcrum(patient.way_in.pivot_mm, patient.way_in.axis)
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
    # a steep way in leaves less room for a cone that must not reach the vertical
    aside_deg = math.degrees(math.acos(min(abs(float(fulcrum.axis[2])), 1.0)))
    cone_deg = min(LIMITS.cone_deg, aside_deg - UPRIGHT_DEG)
    hold = ScopeHold(
        patient.surface.distance,
        radius_mm,
        SHAFT_CHECKED_MM,
        fulcrum.pivot_mm,
        TOUCH_MM,
    )
    return FulcrumControl(fulcrum, replace(LIMITS, cone_deg=cone_deg), hold=hold)


class _HandInput(FlightInput):
    """Steer a scope in the nostril."""

    def __init__(
        self, scenario: Scenario, path: ProbePath | None, handset: Handset | None
    ) -> None:
        self._radius_mm = scenario.scope.endoscope().diameter_mm / 2
        self._path, self._start = path, scenario.start
        self._handset = handset
        self._steering = Steering()
        self.completer = framed_hand()
        self.registration = in_the_patient()

    def open(self, patient: PatientScene) -> AbstractContextManager[SteeredArm]:
        """Put the scope's tip into the nostril."""
        control = scope_control(patient, self._path, self._radius_mm, self._start)
        if not self.is_held_by_walls:
            control.let_go()
        return SteeredArm(control, self._steering, self._handset)


class MouseInput(_HandInput):
    """Steer with keys and mouse; the window passes them on to ``controls``."""

    def __init__(self, scenario: Scenario, path: ProbePath | None) -> None:
        super().__init__(scenario, path, None)
        self.name = "mouse and keyboard"
        self.keys = HELP
        self.controls = MouseKeys(self._steering)


class GamepadInput(_HandInput):
    """Steer with the first gamepad or 3D mouse, or with the one at ``file``."""

    def __init__(
        self, scenario: Scenario, path: ProbePath | None, file: Path | None
    ) -> None:
        pad = open_gamepad(file)
        super().__init__(scenario, path, pad)
        self.name = pad.name
        self.keys = pad.layout.help
