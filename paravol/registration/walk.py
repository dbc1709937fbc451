"""The way through a registration: turn the tip, touch the landmarks, trace the skin."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from devices import DeviceError, Pose
from devices.controls.pedals import PressCollector
from devices.registration.held_point import HeldPoint, HoldError
from devices.registration.pivot import (
    FEWEST_POSES,
    PivotCalibration,
    PivotError,
    calibrate_pivot,
    shifted_to_tip,
)
from devices.registration.surface_fit import FEWEST_POINTS
from paravol.inputs.pose_sources import OrderedPoses, ReconnectingSource

MEASURE_PEDAL = 1
REDO_PEDAL = 2

PATIENCE_S = 60.0
"""A person may take this long from one step to the next."""

SPACING_MM = 1.5
"""Traced points nearer than this to the one before say nothing new."""

LOST_PATIENCE_S = 300.0
"""A lost arm may be away this long; finding and pushing in a plug takes a minute."""

ATTEMPTS = 3

_Found = TypeVar("_Found")


class _TakenBackError(Exception):
    """The left pedal was pressed: the step before is to be done again."""


class Guide(Protocol):
    """What tells a person what to do; `app.cli.terminal.Stages` is one."""

    def __call__(self, stage: str, share: float) -> None: ...

    def say(self, text: str) -> None:
        """Print one line."""
        ...


@dataclass(slots=True)
class RegistrationWalk:
    """Lead a person, who holds the stylus, from step to step.

    A step that went wrong is told in one sentence and asked for again, three times in
    all; then its error is raised. TimeoutError when nothing happens for a minute.
    An arm that is unplugged and looked for by its driver is waited for; what was
    measured stays, only a press during which it went is made again.
    """

    source: OrderedPoses
    guide: Guide
    tip_mm: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    """(3,) where the tip is in the frame of the stated tip; `pivot` finds it."""
    _lasting: ReconnectingSource = field(init=False)
    _was_away: bool = False
    """Whether the arm came back since the last pose was looked at."""

    def __post_init__(self) -> None:
        self._lasting = ReconnectingSource(
            self.source, LOST_PATIENCE_S, self._lost, self._back
        )

    def pivot(self, *, along_axis: bool) -> PivotCalibration:
        """Let the tip be turned in a hole and find it."""
        self.guide.say(
            "Put the tip into a hole, hold the right pedal and swing the stylus "
            "around, 30 degrees to all sides, for eight seconds."
        )

        def once() -> PivotCalibration:
            poses = self._press("Turning the tip", 8 * FEWEST_POSES)
            frames = np.array([pose.device_from_tip for pose in poses])
            return calibrate_pivot(frames, along_axis=along_axis)

        while True:
            try:
                found = self._until_good(once, PivotError)
            except _TakenBackError:
                continue
            self.tip_mm = found.tip_mm
            return found

    def touch(self, names: list[str]) -> list[HeldPoint]:
        """Let every landmark be touched, in order.

        The left pedal takes the last one back.
        """
        self.guide.say(
            "Touch each landmark and hold the right pedal for half a second; the left "
            "pedal takes the last one back."
        )
        stage = "Touching the landmarks"
        held: list[HeldPoint] = []
        while len(held) < len(names):
            self.guide(stage, len(held) / len(names))
            self.guide.say(f"  {len(held) + 1:d} of {len(names):d}: {names[len(held)]}")
            try:
                held.append(
                    self._until_good(lambda: HeldPoint.of(self._press()), HoldError)
                )
            except _TakenBackError:
                if held:
                    held.pop()
        self.guide(stage, 1.0)
        return held

    def trace(self) -> NDArray[np.float64]:
        """Let a patch of skin be traced; return its points (m, 3), device frame."""
        self.guide.say(
            "Hold the right pedal and draw the tip over bridge and cheeks without "
            "lifting it; release the pedal when the bar is full."
        )
        kept: list[NDArray[np.float64]] = []
        while len(kept) < 2 * FEWEST_POINTS:
            try:
                poses = self._press("Tracing the skin", 600)
            except _TakenBackError:
                kept.clear()
                continue
            for pose in poses:
                if not kept or np.linalg.norm(pose.tip_mm - kept[-1]) >= SPACING_MM:
                    kept.append(pose.tip_mm)
            if len(kept) < 2 * FEWEST_POINTS:
                self.guide.say(
                    f"{len(kept)} points so far, {2 * FEWEST_POINTS} are needed: go on."
                )
        return np.array(kept)

    def _until_good(
        self, once: Callable[[], _Found], refusal: type[ValueError]
    ) -> _Found:
        for _ in range(ATTEMPTS - 1):
            try:
                return once()
            except refusal as error:
                self.guide.say(f"  {error}")
        return once()

    def _press(self, stage: str = "", expected: int = 1) -> list[Pose]:
        """Wait for one press of the right pedal; show its growth as a stage."""
        press, redo = PressCollector(MEASURE_PEDAL), PressCollector(REDO_PEDAL)
        since: float | None = None
        # The arm's own time may stand still.
        host_since = time.monotonic()
        is_old = False
        while True:
            measured = self._lasting.read(PATIENCE_S)
            pose = shifted_to_tip(measured, self.tip_mm)
            if self._was_away:
                # Nobody knows what hand and foot did meanwhile.
                press, redo = PressCollector(MEASURE_PEDAL), PressCollector(REDO_PEDAL)
                self._was_away, since, is_old = False, None, True
            is_old = is_old and bool(pose.buttons & (MEASURE_PEDAL | REDO_PEDAL))
            if is_old:
                continue
            if since is None or press.held:
                since, host_since = pose.time_s, time.monotonic()
            if redo.feed(pose) is not None:
                raise _TakenBackError
            done = press.feed(pose)
            if stage:
                self.guide(stage, min(1.0, press.held / expected))
            if done is not None:
                return done
            waited_s = max(pose.time_s - since, time.monotonic() - host_since)
            if waited_s > PATIENCE_S:
                raise TimeoutError(
                    f"Nobody pressed the right pedal for {PATIENCE_S:g} seconds; begin "
                    "again with `paravol register`."
                )

    def _lost(self, loss: DeviceError) -> None:
        self.guide.say(f"  {loss} What was measured is kept.")

    def _back(self, away_s: float) -> None:
        self._was_away = True
        self.guide.say(
            f"  The arm is back after {away_s:.0f} s; release the pedals and go on "
            "with the same step."
        )
