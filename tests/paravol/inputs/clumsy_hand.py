"""A beginner's hand on the mouse, simulated: slow to react, trembling, overshooting.

It knows only where the goal lies in a picture of a quarter of a second ago, as the
overview and the task tell a trainee. It drags, turns the wheel, and draws back where
nothing moves any more: it uses nothing but what the window passes on of a mouse.
"""

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.controls.fulcrum import FulcrumControl
from devices.controls.keyboard import TILT_DEG_PER_PIXEL, MouseKeys
from devices.controls.steered_scope import RATE_HZ, SteeredArm
from devices.controls.steering import Steering
from paravol.patient import PatientScene
from scenarios import Endoscope, shaft_clearance
from scenarios.session import SHAFT_CHECKED_MM
from scenarios.tasks import Situation, Status, TaskEngine
from scenarios.tasks import task as tasks

REACTION_S = 0.25
"""Simple visual reaction takes a fifth to a quarter of a second."""

FRAME_S = 1.0 / 50.0
PIXELS = 512
TREMOR_HZ, TREMOR_PX = 9.0, 2.0
"""Physiological tremor has 8 to 12 Hz."""

HASTE = 3.5
"""Share of an error that is gone a second. With the delay it overshoots by a third."""

SLIP = 0.25
"""Standard error of each stroke, as a share of it."""

NOTCH_S = 0.15
"""Between two notches of the wheel."""

IN_VIEW_PX = 110.0
"""Nearer to the middle than this the goal is gone for."""

PATIENCE_S = 1.2
"""A picture that stands still for so long says that the scope is stuck."""

STILL_MM = 0.6
ASIDE_PX, ASTRAY = 80.0, 0.8
"""How far from where it looked it tries next, at most, and how wrong its way there is,
radians."""


class SimulatedClock:
    """A clock that goes on when it is told to."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now(self) -> float:
        return self.time_s

    def sleep(self, seconds: float) -> None:
        self.time_s += seconds


@dataclass
class Flown:
    """What became of it: seconds until the goal was looked at, and until the tip was
    near it; None for never."""

    looked_s: float | None
    near_s: float | None
    least_gap_mm: float
    drawn_back: int


@dataclass
class _Seen:
    time_s: float
    aside_px: NDArray[np.float64]
    tip_mm: NDArray[np.float64]


@dataclass
class ClumsyHand:
    """Steers by mouse towards a place; see the module."""

    mouse: MouseKeys
    seed: int
    drawn_back: int = 0
    _seen: deque[_Seen] = field(default_factory=deque)
    _shown: deque[_Seen] = field(default_factory=deque)
    _aim_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    _aim_until_s: float = 0.0
    _notch_s: float = 0.0
    _stuck_since_s: float = 0.0
    _back: int = 0

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        self._phase = self._rng.uniform(0.0, 2.0 * np.pi, 2)

    def act(
        self, now_s: float, aside_px: NDArray[np.float64], tip_mm: NDArray[np.float64]
    ) -> None:
        """Take in a picture; do what an older one asks for."""
        self._seen.append(_Seen(now_s, aside_px, tip_mm))
        if self._seen[0].time_s > now_s - REACTION_S:
            return
        while len(self._seen) > 1 and self._seen[1].time_s <= now_s - REACTION_S:
            self._seen.popleft()
        known = self._seen[0]
        self._look(known)
        if now_s >= self._aim_until_s:
            self._aim_px = np.zeros(2)
        error = known.aside_px - self._aim_px
        # it knows how far the picture goes for a stroke of the mouse
        degrees = error * (80.0 / PIXELS)
        stroke = HASTE * FRAME_S * degrees / TILT_DEG_PER_PIXEL
        stroke *= 1.0 + self._rng.normal(0.0, SLIP, 2)
        trembling = 2.0 * np.pi * TREMOR_HZ * now_s + self._phase
        stroke += TREMOR_PX * np.sin(trembling)
        self.mouse.drag(float(stroke[0]), float(stroke[1]), False, now_s)
        if now_s < self._notch_s:
            return
        self._notch_s = now_s + NOTCH_S * self._rng.uniform(0.7, 1.6)
        if self._back > 0:
            self._back -= 1
            self.mouse.wheel(-1.0, now_s)
        elif float(np.hypot(*error)) < IN_VIEW_PX:
            self.mouse.wheel(1.0, now_s)

    def _look(self, known: _Seen) -> None:
        """See whether anything moves; draw back and try beside it where not."""
        self._shown.append(known)
        while self._shown[0].time_s < known.time_s - PATIENCE_S:
            self._shown.popleft()
        way = float(np.linalg.norm(known.tip_mm - self._shown[0].tip_mm))
        is_whole = known.time_s - self._shown[0].time_s > 0.9 * PATIENCE_S
        if way > STILL_MM or not is_whole or self._back:
            return
        self._shown.clear()
        self.drawn_back += 1
        self._back = int(self._rng.integers(2, 6))
        # what holds it lies where it pushes: it tries the other side of the picture
        towards = float(np.arctan2(*known.aside_px[::-1]))
        angle = towards + self._rng.normal(0.0, ASTRAY)
        far = self._rng.uniform(0.4, 1.0) * ASIDE_PX
        self._aim_px = known.aside_px + far * np.array([np.cos(angle), np.sin(angle)])
        self._aim_until_s = known.time_s + self._rng.uniform(2.5, 4.0)


def steer_by_mouse(
    patient: PatientScene,
    control: FulcrumControl,
    scope: Endoscope,
    look: tasks.Look,
    near_mm: float,
    seed: int,
    limit_s: float,
) -> Flown:
    """Let a clumsy hand steer until a task is done and the tip was near its place."""
    clock, steering = SimulatedClock(), Steering()
    arm = SteeredArm(control, steering, clock=clock)
    hand = ClumsyHand(MouseKeys(steering), seed)
    assert isinstance(look.place, str)
    place, distance = patient.landmarks[look.place], patient.surface.distance
    engine = TaskEngine((look,), patient.landmarks)
    flown = Flown(None, None, np.inf, 0)
    frame_s = 0.0
    while clock.time_s < limit_s:
        clock.sleep(1.0 / RATE_HZ)
        arm.drain()
        if clock.time_s < frame_s:
            continue
        frame_s += FRAME_S
        frame = control.frame()
        camera = scope.camera(frame, 0.0, (PIXELS, PIXELS))
        pixel, _ = camera.project(place)
        hand.act(clock.time_s, pixel - PIXELS / 2, frame[:3, 3].copy())
        gap = shaft_clearance(distance, frame, scope.diameter_mm / 2, SHAFT_CHECKED_MM)
        flown.least_gap_mm = min(flown.least_gap_mm, gap.gap_mm)
        flown.drawn_back = hand.drawn_back
        if flown.near_s is None and np.linalg.norm(frame[:3, 3] - place) < near_mm:
            flown.near_s = clock.time_s
        engine.step(Situation(clock.time_s, frame[:3, 3], camera, distance))
        if flown.looked_s is None and engine.states[0].status is Status.DONE:
            flown.looked_s = clock.time_s
        if None not in (flown.looked_s, flown.near_s):
            break
    return flown
