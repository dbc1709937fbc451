"""The second hand at a desk: which tool it holds, its jaws, pedal and suction.

Whoever has one device only carries the tool beside the scope: its tip lies on the
scope's axis, ahead of the lens, and its shaft comes from below.
"""

import math
import threading
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices import Pose
from paravol.inputs.pose_completer import PoseCompleter
from renderers.scene import Volume
from scenarios import Endoscope, InstrumentState, Sample
from scenarios.instrument_state import NO_TOOL

CLOSING_S, OPENING_S = 0.25, 0.35
"""Times in which jaws close and open."""

FIRST_AHEAD_MM = 14.0
NEAREST_MM, FARTHEST_MM = 4.0, 40.0
"""Where a carried tool's tip lies before the lens: at first, at least, at most."""

BITES_MM = 1.5
"""So far into tissue a carried tool is pushed while it works. Else its tip stops at
tissue: nobody hurts anything by carrying."""

STEP_MM = 0.2
"""Shortest step on the way to tissue."""

ASIDE_MM = 5.0
"""So far below the lens the shaft of a carried tool passes: both are 3 to 4 mm wide."""


@dataclass(frozen=True, slots=True)
class _Wish:
    """Hold what was last asked for."""

    tool: str | None = None
    is_working: bool = False
    is_sucking: bool = False
    ahead_mm: float = FIRST_AHEAD_MM
    roll_deg: float = 0.0
    undone: int = 0
    washed: int = 0
    is_frozen: bool = False


class OperatingHand:
    """Put what the second hand does into samples.

    What is asked for may be changed at any time, by any thread. completer: says the
    rest of a sample; a tool that it places itself is left where it is.
    """

    def __init__(self, completer: PoseCompleter, endoscope: Endoscope) -> None:
        self._completer = completer
        self._endoscope = endoscope
        self._wish = _Wish()
        self._lock = threading.Lock()
        self._jaw = 0.0
        self._last_s: float | None = None
        self._reach_mm = math.inf
        self.world_from_device: NDArray[np.float64] = np.eye(4)
        """The registration, 4x4, once it is known."""
        self.distance: Volume | None = None
        """Signed air distance of the head as it is cut, mm, once that is there."""

    @property
    def tool(self) -> str | None:
        """Return the tool that was chosen; None while nobody has."""
        return self._wish.tool

    def choose(self, tool: str) -> None:
        """Take another tool of the catalogue, or `NO_TOOL` for none."""
        self._change(tool=tool, is_working=False)

    def work(self, is_down: bool) -> None:
        """Press the tool's pedal, or let it go."""
        self._change(is_working=is_down)

    def suck(self, is_on: bool) -> None:
        """Turn suction on or off."""
        self._change(is_sucking=is_on)

    def advance(self, by_mm: float) -> None:
        """Move a carried tool along the scope's axis, ahead for positive values.

        From where it is: what tissue holds back does not gather.
        """
        with self._lock:
            ahead = min(self._wish.ahead_mm, self._reach_mm) + by_mm
            ahead = min(max(ahead, NEAREST_MM), FARTHEST_MM)
            self._wish = replace(self._wish, ahead_mm=ahead)

    def roll(self, by_deg: float) -> None:
        """Turn the tool about its axis."""
        with self._lock:
            self._wish = replace(self._wish, roll_deg=self._wish.roll_deg + by_deg)

    def undo(self) -> None:
        """Take the last stroke back."""
        with self._lock:
            self._wish = replace(self._wish, undone=self._wish.undone + 1)

    def wash(self) -> None:
        """Wash the lens."""
        with self._lock:
            self._wish = replace(self._wish, washed=self._wish.washed + 1)

    def freeze(self, is_on: bool) -> None:
        """Let nothing count, and the score's clock stand, or go on."""
        self._change(is_frozen=is_on)

    @property
    def is_frozen(self) -> bool:
        """Return whether the trainer is frozen."""
        return self._wish.is_frozen

    def complete(self, pose: Pose) -> Sample:
        """Join a pose with its channel and with what the second hand does."""
        sample = self._completer.complete(pose)
        wish, given = self._wish, sample.instrument
        name = given.name if wish.tool is None else wish.tool
        is_working = wish.is_working or given.is_working
        state = InstrumentState(
            name,
            given.roll_deg + wish.roll_deg,
            # one that was recorded comes with its jaw
            max(self._jaw_at(sample.time_s, is_working), given.jaw),
            is_working,
            wish.is_sucking or given.is_sucking,
            given.undone + wish.undone,
            given.washed + wish.washed,
        )
        is_frozen = wish.is_frozen or sample.is_frozen
        sample = replace(sample, instrument=state, is_frozen=is_frozen)
        if given.name == NO_TOOL and name != NO_TOOL:
            sample = self._carried(sample, wish.ahead_mm)
        return sample

    def _change(self, **changes: Any) -> None:
        with self._lock:
            self._wish = replace(self._wish, **changes)

    def _jaw_at(self, time_s: float, is_working: bool) -> float:
        """Move the jaw towards open or closed in the samples' time."""
        elapsed_s = 0.0 if self._last_s is None else max(time_s - self._last_s, 0.0)
        self._last_s = time_s
        if is_working:
            self._jaw = min(self._jaw + elapsed_s / CLOSING_S, 1.0)
        else:
            self._jaw = max(self._jaw - elapsed_s / OPENING_S, 0.0)
        return self._jaw

    def _carried(self, sample: Sample, ahead_mm: float) -> Sample:
        """Place the tool before the lens, on the axis of the picture."""
        world_from_tip = self.world_from_device @ sample.device_from_tip
        camera = self._endoscope.camera(world_from_tip, sample.roll_deg, (8, 8))
        eye, _, up, forward = camera.frame
        self._reach_mm = self._reach(eye, forward)
        pushed_mm = BITES_MM * sample.instrument.jaw
        tip = eye + min(ahead_mm, self._reach_mm + pushed_mm) * forward
        axis = tip - (eye - ASIDE_MM * up)
        return replace(
            sample,
            instrument_tip_mm=tip,
            instrument_pointing=axis / np.linalg.norm(axis),
        )

    def _reach(self, eye: NDArray[np.float64], forward: NDArray[np.float64]) -> float:
        """Return how far ahead of the lens a tip may be: where tissue begins, mm."""
        distance = self.distance
        if distance is None or not np.all(np.isfinite(eye + forward)):
            return math.inf
        matrix = distance.voxel_from_world
        start, along = matrix[:3, :3] @ eye + matrix[:3, 3], matrix[:3, :3] @ forward
        at_mm = before_mm = before = 0.0
        while at_mm < FARTHEST_MM:
            here = distance.at_voxel(start + at_mm * along)
            if here >= 0.0:
                if before < 0.0:
                    share = before / (before - here)
                    at_mm = before_mm + share * (at_mm - before_mm)
                return at_mm
            before_mm, before = at_mm, here
            at_mm += max(-here, STEP_MM)
        return math.inf
