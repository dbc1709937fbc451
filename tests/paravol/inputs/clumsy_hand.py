"""A beginner's hand on the mouse, simulated: slow to react, trembling, overshooting.

It knows only what was shown a quarter of a second ago: where the goal and the mark of
the shaft lie in the picture, how far away the overview shows the goal, whether the task
is done. It steers the goal to where the shaft goes, which is the middle of a straight
scope's picture only, turns the light post to look, turns the wheel, and draws back
where nothing moves any more: it uses nothing but what the window passes on of a mouse.
"""

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.controls.fulcrum import FulcrumControl
from devices.controls.keyboard import ROLL_DEG_PER_PIXEL, TILT_DEG_PER_PIXEL, MouseKeys
from devices.controls.steered_scope import RATE_HZ, SteeredArm
from devices.controls.steering import Steering
from paravol.feedback.shaft_heading import shaft_heading
from paravol.inputs.flight_input import framed_hand
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
LOOK_MM, BESIDE_DEG = 25.0, 20.0
"""Nearer to the goal than this it looks at it, until that is done: it turns the post
until the picture's middle lies on the goal's side of the shaft."""

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


@dataclass(frozen=True)
class Seen:
    """What is shown at a moment; places in the picture count from its middle.

    goal_px: the goal. heading_px: where the shaft goes, as the window marks it.
    away_mm: from tip to goal, and tip_mm: both as the overview shows them. is_done:
    the task panel says that the goal was looked at.
    """

    time_s: float
    goal_px: NDArray[np.float64]
    heading_px: NDArray[np.float64]
    tip_mm: NDArray[np.float64]
    away_mm: float
    is_done: bool

    @property
    def turn_deg(self) -> float:
        """Return by how much the post is to be turned for the picture to show the goal.

        Clockwise. The middle goes round the mark of the shaft, to the goal's side.
        """
        goal = self.goal_px - self.heading_px
        if not np.any(self.heading_px):
            return 0.0
        sides = np.arctan2(goal[1], goal[0]) - np.arctan2(*-self.heading_px[::-1])
        return math.remainder(math.degrees(sides), 360.0)


@dataclass
class ClumsyHand:
    """Steers by mouse towards a place; see the module."""

    mouse: MouseKeys
    seed: int
    drawn_back: int = 0
    _seen: deque[Seen] = field(default_factory=deque)
    _shown: deque[Seen] = field(default_factory=deque)
    _aim_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    _aim_until_s: float = 0.0
    _notch_s: float = 0.0
    _stuck_since_s: float = 0.0
    _back: int = 0

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        self._phase = self._rng.uniform(0.0, 2.0 * np.pi, 2)

    def act(self, seen: Seen) -> None:
        """Take in what is shown; do what an older picture asks for."""
        now_s = seen.time_s
        self._seen.append(seen)
        if self._seen[0].time_s > now_s - REACTION_S:
            return
        while len(self._seen) > 1 and self._seen[1].time_s <= now_s - REACTION_S:
            self._seen.popleft()
        known = self._seen[0]
        self._look(known)
        if now_s >= self._aim_until_s:
            self._aim_px = np.zeros(2)
        error = known.goal_px - known.heading_px - self._aim_px
        turn_deg = known.turn_deg
        is_looking = known.away_mm < LOOK_MM and not known.is_done
        if is_looking and abs(turn_deg) > BESIDE_DEG:
            # one hand has one mouse: it turns the post, or it tilts the shaft
            stroke = np.array([HASTE * FRAME_S * turn_deg / ROLL_DEG_PER_PIXEL, 0.0])
        else:
            # it knows how far the picture goes for a stroke of the mouse
            degrees = error * (80.0 / PIXELS)
            stroke = HASTE * FRAME_S * degrees / TILT_DEG_PER_PIXEL
            is_looking = False
        stroke *= 1.0 + self._rng.normal(0.0, SLIP, 2)
        trembling = 2.0 * np.pi * TREMOR_HZ * now_s + self._phase
        stroke += TREMOR_PX * np.sin(trembling)
        self.mouse.drag(float(stroke[0]), float(stroke[1]), is_looking, now_s)
        if now_s < self._notch_s:
            return
        self._notch_s = now_s + NOTCH_S * self._rng.uniform(0.7, 1.6)
        if self._back > 0:
            self._back -= 1
            self.mouse.wheel(-1.0, now_s)
        elif not is_looking and float(np.hypot(*error)) < IN_VIEW_PX:
            self.mouse.wheel(1.0, now_s)

    def _look(self, known: Seen) -> None:
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
        aside_px = known.goal_px - known.heading_px
        towards = float(np.arctan2(*aside_px[::-1]))
        angle = towards + self._rng.normal(0.0, ASTRAY)
        far = self._rng.uniform(0.4, 1.0) * ASIDE_PX
        self._aim_px = aside_px + far * np.array([np.cos(angle), np.sin(angle)])
        self._aim_until_s = known.time_s + self._rng.uniform(2.5, 4.0)


def steer_by_mouse(
    patient: PatientScene,
    control: FulcrumControl,
    scope: Endoscope,
    look: tasks.LookTask,
    near_mm: float,
    seed: int,
    limit_s: float,
) -> Flown:
    """Let a clumsy hand steer until a task is done and the tip was near its place."""
    clock, steering = SimulatedClock(), Steering()
    arm = SteeredArm(control, steering, clock=clock)
    hand = ClumsyHand(MouseKeys(steering), seed)
    completer = framed_hand()
    assert isinstance(look.place, str)
    place, distance = patient.landmarks[look.place], patient.surface.distance
    engine = TaskEngine((look,), patient.landmarks)
    flown = Flown(None, None, np.inf, 0)
    frame_s = 0.0
    while clock.time_s < limit_s:
        clock.sleep(1.0 / RATE_HZ)
        poses = arm.drain()
        if clock.time_s < frame_s or not poses:
            continue
        frame_s += FRAME_S
        sample = completer.complete(poses[-1])
        frame = sample.device_from_tip
        camera = scope.camera(frame, sample.roll_deg, (PIXELS, PIXELS))
        pixel, _ = camera.project(place)
        heading = shaft_heading(camera, frame) or (0.5, 0.5)
        is_done = flown.looked_s is not None
        tip_mm = frame[:3, 3].copy()
        away_mm = float(np.linalg.norm(place - tip_mm))
        hand.act(
            Seen(
                clock.time_s,
                pixel - PIXELS / 2,
                (np.array(heading) - 0.5) * PIXELS,
                tip_mm,
                away_mm,
                is_done,
            )
        )
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
