"""The channel beside the arm: it completes a pose with roll and the second tool."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from devices import Pose, ProbePath, ProbeSample
from devices.controls.pedals import Button, ButtonEvent
from devices.controls.roll import HorizonRoll, RollSource
from scenarios import InstrumentState, Sample
from scenarios.bundle import EventRecord
from scenarios.instrument_state import EMPTY_HAND, FIRST_TOOL

PATH_PEDAL = 2
"""Button bit that is down while a recorded path is being flown."""

PATH_WORK, PATH_SUCTION = 4, 8
"""Button bits of a path's second channel: its tool works, or sucks."""

AWAY_MM = np.array([0.0, -400.0, -400.0])
"""Where an absent second tool is placed: far in front of the face."""


PEDAL_NAMES = {Button.RIGHT_PEDAL: "right pedal", Button.LEFT_PEDAL: "left pedal"}


class PoseCompleter(Protocol):
    """Adds the second channel to poses: roll and the second tool."""

    def complete(self, pose: Pose) -> Sample:
        """Join a pose with the second channel's state at its time."""
        ...


@dataclass(slots=True)
class PathChannel:
    """Follow a recorded path's second channel, from the moment the path begins."""

    path: ProbePath
    _began_s: float | None = None

    def complete(self, pose: Pose) -> Sample:
        """Join a pose with the channel; before the path begins its time is -1."""
        if self._began_s is None:
            if not pose.buttons & PATH_PEDAL:
                return _sample(pose, -1.0, self.path, 0.0)
            self._began_s = pose.time_s
        time_s = pose.time_s - self._began_s
        return _sample(pose, time_s, self.path, time_s)


@dataclass(slots=True)
class HandChannel:
    """Serve a free hand: roll from a source, no second tool.

    While the source does not know the roll, the last one is held, at first 0.
    """

    roll: RollSource = field(default_factory=HorizonRoll)
    _began_s: float | None = None
    _roll_deg: float = 0.0

    def complete(self, pose: Pose) -> Sample:
        """Join a pose with the present roll; time counts from the first pose."""
        if self._began_s is None:
            self._began_s = pose.time_s
        known = self.roll.roll_deg(pose)
        if known is not None:
            self._roll_deg = known
        return Sample(
            pose.time_s - self._began_s,
            pose.device_from_tip,
            self._roll_deg,
            AWAY_MM,
            np.array([0.0, 1.0, 0.0]),
            pose.buttons,
            EMPTY_HAND,
        )


def pedal_record(event: ButtonEvent, time_s: float) -> EventRecord:
    """Describe an edge for the recording; time_s is that of the session."""
    edge = "down" if event.is_down else "up"
    return EventRecord(time_s, "button", f"{PEDAL_NAMES[event.button]} {edge}")


def _sample(pose: Pose, time_s: float, path: ProbePath, at_s: float) -> Sample:
    state = path.sample(at_s)
    return Sample(
        time_s,
        pose.device_from_tip,
        state.roll_deg,
        state.instrument_tip_mm,
        state.instrument_axis,
        pose.buttons,
        path_instrument(state),
        scope_deg=state.scope_deg,
    )


def path_instrument(state: ProbeSample) -> InstrumentState:
    """Return what a path's second hand does at a moment."""
    return InstrumentState(
        FIRST_TOOL if state.tool is None else state.tool,
        state.instrument_roll_deg,
        state.jaw,
        is_working=bool(state.buttons & PATH_WORK),
        is_sucking=bool(state.buttons & PATH_SUCTION),
    )
