"""The second hand: which tool it holds, where, its jaws, pedal and suction.

A second device moves the tool. Whoever has none points at places of the picture, by
mouse, and the tool's tip goes there; while nobody points it stays where it is. Or the
scope is held where it is, and its device moves the tool.
"""

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices import Pose
from paravol.inputs.instrument_input import (
    SUCTION_BUTTON,
    WORK_BUTTON,
    InstrumentInput,
)
from paravol.inputs.jaw import Jaw
from paravol.inputs.picture_ray import FARTHEST_MM
from paravol.inputs.pointed_tool import (
    LONGEST_S,
    NEAREST_MM,
    PointedTool,
)
from paravol.inputs.pose_completer import AWAY_MM
from paravol.inputs.second_device import SecondDevice
from paravol.inputs.tool_hold import BITES_MM, ToolHold, roll_deg, tool_of_shaft
from paravol.inputs.tool_plan import shaves
from paravol.inputs.turns import DeviceTurns
from scenarios import Endoscope, InstrumentState, Sample
from scenarios.instrument_state import EMPTY_HAND, FIRST_TOOL, NO_TOOL
from system import UserError

FIRST_AHEAD_MM = 14.0
"""So far before the lens a tool is brought at first, mm."""

FIRST_AT = 0.0, -0.3
"""And there in the picture, where nobody has pointed yet: tools come from below."""


@dataclass(frozen=True, slots=True)
class _PendingRequest:
    """What was last asked for."""

    tool: str | None = None
    is_working: bool = False
    is_sucking: bool = False
    at: tuple[float, float] = FIRST_AT
    ahead_mm: float = FIRST_AHEAD_MM
    is_pointing: bool = True
    roll_deg: float = 0.0
    undone: int = 0
    washed: int = 0
    is_frozen: bool = False


class InstrumentController:
    """Put what the second hand does into samples.

    What is asked for may be changed at any time, by any thread. tools: that may be
    used; none: all of the catalogue.
    """

    def __init__(self, endoscope: Endoscope, tools: Sequence[str] = ()) -> None:
        self._endoscope = endoscope
        self.tools = tuple(tools)
        self._wish = _PendingRequest()
        self._lock = threading.Lock()
        self._jaw = Jaw()
        self.world_from_device: NDArray[np.float64] = np.eye(4)
        """The registration, 4x4, once it is known."""
        self.pointed: PointedTool | None = None
        """The tool that goes where somebody points; None where no nostril is known."""
        self.is_scope_laid: Callable[[], bool] = lambda: False
        """Tells whether the scope is on its way to another place: a tool leaves it."""
        self.felt_n: Callable[[], float] = lambda: 0.0
        """Tells how hard the tool presses, N."""
        self.open_task: Callable[[], str | None] = lambda: None
        """Tells the name of the task that is to be done."""
        self._name = NO_TOOL
        self._last_s = math.inf
        self._shaft: NDArray[np.float64] | None = None
        """The shaft's frame of the last sample, None without a tool in hand."""
        self._swaps = 0
        self._second: tuple[InstrumentInput, SecondDevice] | None = None
        self.turns: DeviceTurns | None = None
        """Gives the scope's device to the tool and back; None where that cannot be."""

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
        self._change(tool=tool, is_working=False, roll_deg=0.0)
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
        """Move the tip's place along its ray, ahead for positive values.

        From where it is: what tissue holds back does not gather.
        """
        reach_mm = math.inf if self.pointed is None else self.pointed.reach_mm
        with self._lock:
            ahead = min(self._wish.ahead_mm, reach_mm) + by_mm
            ahead = min(max(ahead, NEAREST_MM), FARTHEST_MM)
            self._wish = replace(self._wish, ahead_mm=ahead)

    def point(self, right: float, up: float) -> None:
        """Bring the tip to where this place of the picture lies.

        From the picture's middle, 1 at its rim.
        """
        self._change(at=(right, up))

    def let_point(self, is_on: bool) -> None:
        """Let the tool follow the place that is pointed at, or stay where it is."""
        self._change(is_pointing=is_on)

    @property
    def is_pointing(self) -> bool:
        """Return whether there is a tool that follows the place pointed at."""
        return self._wish.is_pointing and self._wish.tool not in (None, NO_TOOL)

    @property
    def is_stuck(self) -> bool:
        """Return whether tissue keeps a pointed tool from its place."""
        return (
            self._name != NO_TOOL
            and self.pointed is not None
            and (self.pointed.is_stuck)
        )

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

    def take_turns(self, pose: Pose) -> Pose:
        """Return the scope's pose; the device's own unless the tool has the device."""
        turns = self.turns
        if turns is None:
            return pose
        self._hand_over(turns, pose)
        return turns.scope(pose)

    def hold(self, sample: Sample, pose: Pose) -> Sample:
        """Return the sample with what the second hand does at the time of a pose.

        A tool that the sample places itself is left where it is.
        """
        turns = self.turns
        wish, given = self._wish, sample.instrument
        moved: Pose | None = None
        if self._second is not None:
            moved = self._second[1].at(pose.host_time_s)
            given = self._given(moved)
        name = given.name if wish.tool is None else wish.tool
        if self._second is not None and moved is None:
            name = NO_TOOL
        is_working = wish.is_working or given.is_working
        pointed = self.pointed
        is_pointed = self._second is None and given.name == NO_TOOL
        if name != self._name:
            self._name = name
            if is_pointed and pointed is not None:
                pointed.put_in()
                self._jaw = Jaw(pointed.shut)
        # it goes in and out with its jaws closed, and does nothing there
        shut = pointed.shut if is_pointed and pointed is not None else 0.0
        is_working = is_working and not shut
        rest = 0.0
        if is_pointed and pointed is not None:
            rest = pointed.rest(is_working=is_working)
        closes = not is_pointed or pointed is None or pointed.closes
        jaw = self._jaw.at(sample.time_s, is_working and closes, rest)
        state = InstrumentState(
            name,
            given.roll_deg + wish.roll_deg,
            # one that was recorded comes with its jaw
            max(jaw, given.jaw),
            is_working,
            wish.is_sucking or given.is_sucking,
            given.undone + wish.undone,
            given.washed + wish.washed,
        )
        if wish.is_frozen:
            sample = replace(sample, is_frozen=True)
        if self._second is not None:
            return self._followed(sample, state, moved)
        if given.name != NO_TOOL or name == NO_TOOL:
            # a channel that places its tool is left alone
            self._shaft = None
            return replace(sample, instrument=state)
        if turns is not None and turns.has_tool:
            return self._by_turns(sample, state, pose, turns)
        if pointed is None:
            self._shaft = None
            return _away(sample, state)
        return self._pointed(sample, state, pointed, wish)

    def at_bite(self, sample: Sample) -> Sample:
        """Return a sample with its pointed tool where its pedal would bring it."""
        pointed, name = self.pointed, sample.instrument.name
        if pointed is None or not self.is_pointing or name == NO_TOOL:
            return sample
        bite = pointed.tell()
        if shaves(name) and pointed.is_there and not sample.instrument.is_working:
            bite = pointed.pressed, sample.instrument.jaw
        if bite is None:
            return sample
        frame = tool_of_shaft(name, bite[0])
        state = replace(sample.instrument, jaw=bite[1], roll_deg=roll_deg(frame))
        return _at(sample, state, frame)

    def _hand_over(self, turns: DeviceTurns, pose: Pose) -> None:
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

    def _followed(
        self, sample: Sample, state: InstrumentState, moved: Pose | None
    ) -> Sample:
        """Place the tool where the second device has it; away where it is lost."""
        assert self._second is not None
        instrument = self._second[0]
        if instrument.hold is not None:
            self._push(instrument.hold, sample.time_s, state)
        if moved is None or state.name == NO_TOOL:
            return _away(sample, state)
        frame = moved.device_from_tip
        if instrument.state(moved) is not None:
            # a recording's roll is in its state already
            return _at(sample, state, frame)
        if instrument.moves_shaft:
            frame = tool_of_shaft(state.name, frame)
        turn = roll_deg(frame) if instrument.knows_roll else 0.0
        return _at(sample, replace(state, roll_deg=turn + state.roll_deg), frame)

    def _by_turns(
        self, sample: Sample, state: InstrumentState, pose: Pose, turns: DeviceTurns
    ) -> Sample:
        """Place the tool where the scope's device has it, or left it."""
        if turns.hold is not None:
            self._push(turns.hold, sample.time_s, state)
        self._shaft = turns.shaft(pose)
        frame = tool_of_shaft(state.name, self._shaft)
        turn = roll_deg(frame) + self._wish.roll_deg
        state = replace(state, roll_deg=turn, is_carried=not turns.is_in_nostril)
        return _at(sample, state, frame)

    def _push(self, hold: ToolHold, time_s: float, state: InstrumentState) -> None:
        """Let a hold know what the hand does, and how hard it pushes."""
        hold.state = state
        elapsed_s = min(max(time_s - self._last_s, 0.0), LONGEST_S)
        self._last_s = time_s
        bite_mm = BITES_MM * state.jaw if state.is_working else 0.0
        hold.push(bite_mm, self.felt_n(), elapsed_s, is_held=False)

    def _change(self, **changes: Any) -> None:
        with self._lock:
            self._wish = replace(self._wish, **changes)

    def _pointed(
        self,
        sample: Sample,
        state: InstrumentState,
        tool: PointedTool,
        wish: _PendingRequest,
    ) -> Sample:
        """Let the tool go to where somebody points in the picture."""
        world_from_tip = self.world_from_device @ sample.device_from_tip
        if wish.is_pointing and np.all(np.isfinite(world_from_tip)):
            scope = self._endoscope.at(sample.scope_deg)
            camera = scope.camera(
                world_from_tip, sample.roll_deg, (8, 8), sample.camera_roll_deg
            )
            tool.withdraws = self.is_scope_laid()
            tool.ask(self.open_task())
            self._shaft = tool.follow(
                camera,
                world_from_tip,
                scope.diameter_mm / 2,
                wish.at,
                wish.ahead_mm,
                state,
                sample.time_s,
                self.felt_n(),
            )
        else:
            self._shaft = tool.stay(state, sample.time_s)
        frame = tool_of_shaft(state.name, self._shaft)
        state = replace(state, roll_deg=roll_deg(frame), is_carried=True)
        return _at(sample, state, frame)


def _away(sample: Sample, state: InstrumentState) -> Sample:
    """Return the sample without a tool."""
    return replace(
        sample,
        instrument=replace(state, name=NO_TOOL, is_working=False),
        instrument_tip_mm=AWAY_MM,
        instrument_pointing=np.array([0.0, 1.0, 0.0]),
    )


def _at(sample: Sample, state: InstrumentState, tool: NDArray[np.float64]) -> Sample:
    """Return the sample with its tool at a frame, 4x4."""
    return replace(
        sample,
        instrument=state,
        instrument_tip_mm=tool[:3, 3].copy(),
        instrument_pointing=-tool[:3, 2],
    )
