"""The second hand: which tool it holds, where, its jaws, pedal and suction.

A second device moves the tool. Whoever has one device only carries the tool beside the
scope: its tip lies on the scope's axis, ahead of the lens, and its shaft comes from
below. Or the scope is held where it is, and the device moves the tool.
"""

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices import Pose
from disk import UserError
from paravol.inputs.instrument_input import (
    SUCTION_BUTTON,
    WORK_BUTTON,
    InstrumentInput,
)
from paravol.inputs.jaw import Jaw
from paravol.inputs.pose_completer import AWAY_MM, PoseCompleter
from paravol.inputs.second_device import SecondDevice
from paravol.inputs.tool_hold import (
    BITES_MM,
    ToolHold,
    roll_deg,
    shaft_of_tool,
    tool_of_shaft,
)
from paravol.inputs.turns import DeviceTurns
from renderers.scene import Volume
from scenarios import Endoscope, InstrumentState, Sample, tip_frame
from scenarios.instrument_state import EMPTY_HAND, FIRST_TOOL, NO_TOOL

FIRST_AHEAD_MM = 14.0
NEAREST_MM, FARTHEST_MM = 4.0, 40.0
"""Where a carried tool's tip lies before the lens: at first, at least, at most."""

STEP_MM = 0.2
"""Shortest step on the way to tissue."""

ASIDE_MM = 5.0
"""So far below the lens the shaft of a carried tool passes: both are 3 to 4 mm wide."""

BEHIND_MM = 8.0
"""A carried tool that walls keep so far off its place is lifted out and comes on."""


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
    rest of a sample; a tool that it places itself is left where it is. tools: that may
    be used; none: all of the catalogue.
    """

    def __init__(
        self,
        completer: PoseCompleter,
        endoscope: Endoscope,
        tools: Sequence[str] = (),
    ) -> None:
        self._completer = completer
        self._endoscope = endoscope
        self.tools = tuple(tools)
        self._wish = _Wish()
        self._lock = threading.Lock()
        self._jaw = Jaw()
        self._reach_mm = math.inf
        self.world_from_device: NDArray[np.float64] = np.eye(4)
        """The registration, 4x4, once it is known."""
        self._distance: Volume | None = None
        self._carried_hold: ToolHold | None = None
        self._shaft: NDArray[np.float64] | None = None
        """The shaft's frame of the last sample, None without a tool in hand."""
        self._swaps = 0
        self._second: tuple[InstrumentInput, SecondDevice] | None = None
        self.turns: DeviceTurns | None = None
        """Gives the scope's device to the tool and back; None where that cannot be."""

    @property
    def distance(self) -> Volume | None:
        """Return the signed air distance of the head as it is cut, mm, if known."""
        return self._distance

    @distance.setter
    def distance(self, distance: Volume | None) -> None:
        self._distance = distance
        self._carried_hold = None
        if distance is not None:
            self._carried_hold = ToolHold(distance, np.zeros(3))

    def follow(self, instrument: InstrumentInput, device: SecondDevice) -> None:
        """Let a second device move the tool from now on."""
        self._second = instrument, device

    @property
    def tool(self) -> str | None:
        """Return the tool that was chosen; None while nobody has."""
        return self._wish.tool

    def choose(self, tool: str) -> None:
        """Take another tool of the catalogue, or `NO_TOOL` for none.

        UserError for one that the exercise does not allow.
        """
        if self.tools and tool not in (*self.tools, NO_TOOL):
            raise UserError(
                f"The exercise does not allow the {tool}; it allows: "
                f"{', '.join(self.tools)}."
            )
        self._change(tool=tool, is_working=False)
        turns = self.turns
        if turns is not None and not turns.is_tools:
            # it is put in anew
            turns.has_tool = False

    def work(self, is_down: bool) -> None:
        """Press the tool's pedal, or let it go."""
        self._change(is_working=is_down)

    def swap(self) -> bool:
        """Hold the scope and give its device to the tool, or give it back.

        Return whether that can be: with a tool in hand, and a device to be given.
        """
        if self.turns is None or self._second is not None or self._shaft is None:
            return False
        with self._lock:
            self._swaps += 1
        return True

    @property
    def holds_scope(self) -> bool:
        """Return whether the device moves the tool, or is about to."""
        is_tools = self.turns is not None and self.turns.is_tools
        return is_tools != bool(self._swaps % 2)

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
        turns = self.turns
        if turns is not None:
            self._take_turns(turns, pose)
            sample = self._completer.complete(turns.scope(pose))
        else:
            sample = self._completer.complete(pose)
        wish, given = self._wish, sample.instrument
        moved: Pose | None = None
        if self._second is not None:
            moved = self._second[1].at(pose.host_time_s)
            given = self._given(moved)
        name = given.name if wish.tool is None else wish.tool
        if self._second is not None and moved is None:
            name = NO_TOOL
        is_working = wish.is_working or given.is_working
        state = InstrumentState(
            name,
            given.roll_deg + wish.roll_deg,
            # one that was recorded comes with its jaw
            max(self._jaw.at(sample.time_s, is_working), given.jaw),
            is_working,
            wish.is_sucking or given.is_sucking,
            given.undone + wish.undone,
            given.washed + wish.washed,
        )
        is_frozen = wish.is_frozen or sample.is_frozen
        sample = replace(sample, instrument=state, is_frozen=is_frozen)
        if self._second is not None:
            return self._followed(sample, moved)
        if given.name != NO_TOOL or name == NO_TOOL:
            # a channel that places its tool is left alone
            self._shaft = None
            return sample
        if turns is not None and turns.has_tool:
            return self._by_turns(sample, pose, turns)
        return self._carried(sample, wish.ahead_mm)

    def _take_turns(self, turns: DeviceTurns, pose: Pose) -> None:
        """Give the device over where somebody asked for it; never without a tool."""
        with self._lock:
            swaps, self._swaps = self._swaps, 0
        turns.world_from_device = self.world_from_device
        wants = turns.is_tools != bool(swaps % 2)
        if self._wish.tool == NO_TOOL:
            wants = False
            self._shaft = None
        if wants and not turns.is_tools and self._shaft is not None:
            turns.to_tool(self._shaft, pose)
        elif not wants and turns.is_tools:
            turns.to_scope(pose)
            turns.has_tool = self._shaft is not None

    def _given(self, moved: Pose | None) -> InstrumentState:
        """Return what the second device says of the tool beside its place."""
        if self._second is None or moved is None:
            return EMPTY_HAND
        recorded = self._second[0].state(moved)
        if recorded is not None:
            return recorded
        buttons = moved.buttons
        name = FIRST_TOOL
        if self.tools and name not in self.tools:
            name = self.tools[0]
        return InstrumentState(
            name,
            is_working=bool(buttons & WORK_BUTTON),
            is_sucking=bool(buttons & SUCTION_BUTTON),
        )

    def _followed(self, sample: Sample, moved: Pose | None) -> Sample:
        """Place the tool where the second device has it; away where it is lost."""
        assert self._second is not None
        instrument = self._second[0]
        state = sample.instrument
        if instrument.hold is not None:
            instrument.hold.state = state
        if moved is None or state.name == NO_TOOL:
            return replace(
                sample,
                instrument=replace(state, name=NO_TOOL, is_working=False),
                instrument_tip_mm=AWAY_MM,
                instrument_pointing=np.array([0.0, 1.0, 0.0]),
            )
        frame = moved.device_from_tip
        if instrument.state(moved) is not None:
            # a recording's roll is in its state already
            return _at(sample, frame, state.roll_deg)
        if instrument.moves_shaft:
            frame = tool_of_shaft(state.name, frame)
        turn = roll_deg(frame) if instrument.knows_roll else 0.0
        return _at(sample, frame, turn + state.roll_deg)

    def _by_turns(self, sample: Sample, pose: Pose, turns: DeviceTurns) -> Sample:
        """Place the tool where the scope's device has it, or left it."""
        state = sample.instrument
        if turns.hold is not None:
            turns.hold.state = state
        self._shaft = turns.shaft(pose)
        frame = tool_of_shaft(state.name, self._shaft)
        is_carried = not turns.is_in_nostril
        sample = replace(sample, instrument=replace(state, is_carried=is_carried))
        return _at(sample, frame, roll_deg(frame) + self._wish.roll_deg)

    def _change(self, **changes: Any) -> None:
        with self._lock:
            self._wish = replace(self._wish, **changes)

    def _carried(self, sample: Sample, ahead_mm: float) -> Sample:
        """Place the tool before the lens, on the axis of the picture."""
        world_from_tip = self.world_from_device @ sample.device_from_tip
        scope = self._endoscope.at(sample.scope_deg)
        camera = scope.camera(world_from_tip, sample.roll_deg, (8, 8))
        eye, _, up, forward = camera.frame
        self._reach_mm = self._reach(eye, forward)
        pushed_mm = BITES_MM * sample.instrument.jaw
        tip = eye + min(ahead_mm, self._reach_mm + pushed_mm) * forward
        axis = tip - (eye - ASIDE_MM * up)
        state = replace(sample.instrument, is_carried=True)
        tool = tip_frame(tip, axis, state.roll_deg)
        sample = replace(sample, instrument=state)
        if not np.all(np.isfinite(tool)):
            self._shaft = None
            return _at(sample, tool, state.roll_deg)
        wanted = shaft_of_tool(state.name, tool)
        self._shaft = shaft = self._held_aside(wanted, state, eye, forward)
        if shaft is wanted:
            return replace(
                sample,
                instrument_tip_mm=tip,
                instrument_pointing=axis / np.linalg.norm(axis),
            )
        return _at(sample, tool_of_shaft(state.name, shaft), state.roll_deg)

    def _held_aside(
        self,
        wanted: NDArray[np.float64],
        state: InstrumentState,
        eye: NDArray[np.float64],
        forward: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return the shaft's frame where walls beside the way hold it, too."""
        hold, start = self._carried_hold, self._shaft
        if hold is None:
            return wanted
        if start is None or np.linalg.norm(start[:3, 3] - wanted[:3, 3]) > BEHIND_MM:
            start = wanted
        hold.state = state
        ahead = np.append(forward, -float(eye @ forward))
        return hold.carried(start, wanted, ahead, self._reach_mm)

    def _reach(self, eye: NDArray[np.float64], forward: NDArray[np.float64]) -> float:
        """Return how far ahead of the lens a tip may be: where tissue begins, mm."""
        distance = self._distance
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


def _at(sample: Sample, tool: NDArray[np.float64], turn_deg: float) -> Sample:
    """Return the sample with its tool at a frame, 4x4, with a roll."""
    return replace(
        sample,
        instrument_tip_mm=tool[:3, 3].copy(),
        instrument_pointing=-tool[:3, 2],
        instrument=replace(sample.instrument, roll_deg=turn_deg),
    )
