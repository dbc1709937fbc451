"""One device for scope and tool, by turns: whichever it leaves is held where it is.

So works a holder or an assistant who keeps the scope still.
"""

import time
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from devices import Pose
from devices.controls.fulcrum import FulcrumControl
from devices.controls.handover import Handover
from devices.controls.steered_scope import SteeredArm
from paravol.inputs.second_device import PoseJoin
from paravol.inputs.tool_hold import ToolHold

Doubles = NDArray[np.float64]


class DeviceTurns(ABC):
    """Give a device to the tool and back, without a jump of either.

    is_tools: whether the tool has it. world_from_device: 4x4, once it is known.
    """

    is_tools: bool = False
    has_tool: bool = False
    """Whether the tool is where this says, and not carried before the lens."""
    world_from_device: Doubles = np.eye(4)
    hold: ToolHold | None = None
    """Walls that hold the tool; None where nothing is moved off its measured place."""

    @abstractmethod
    def to_tool(self, shaft: Doubles, pose: Pose) -> None:
        """Hold the scope, and move the tool's shaft from a frame in the patient, 4x4.

        pose: of the device, as it came.
        """

    @abstractmethod
    def to_scope(self, pose: Pose) -> None:
        """Leave the tool where it is, and move the scope again."""

    @abstractmethod
    def scope(self, pose: Pose) -> Pose:
        """Return the scope's pose when the device was at this one."""

    @abstractmethod
    def shaft(self, pose: Pose) -> Doubles:
        """Return the frame of the tool's shaft in the patient, 4x4."""

    @property
    @abstractmethod
    def is_in_nostril(self) -> bool:
        """Return whether the tool's shaft passes through the nostril."""


class SteeredTurns(DeviceTurns):
    """Give keys, a mouse or a gamepad to the tool's own pivot in the nostril."""

    def __init__(
        self, handover: Handover, control: FulcrumControl, hold: ToolHold
    ) -> None:
        """Take the tool's control, which is held by `hold`."""
        self.hold = hold
        self._handover = handover
        self._control = control
        self._pivot_mm = control.fulcrum.pivot_mm
        self._source = SteeredArm(
            control, handover.tool, is_still=lambda: not self.is_tools
        )
        self._join = PoseJoin()

    def to_tool(self, shaft: Doubles, pose: Pose) -> None:
        """Give the hand to the tool; one that was carried goes on to its pivot."""
        self._drop_waiting()
        if not self.has_tool:
            self._control.place(shaft)
        self.is_tools = self.has_tool = True
        self._handover.give(True, time.monotonic())

    def to_scope(self, pose: Pose) -> None:
        """Give the hand to the scope."""
        self.is_tools = False
        self._handover.give(False, time.monotonic())

    def scope(self, pose: Pose) -> Pose:
        """Return the pose as it is: nothing moves a scope that has no hand."""
        return pose

    def shaft(self, pose: Pose) -> Doubles:
        """Return where the tool was at the time of the pose."""
        assert self.hold is not None
        self.hold.move_to(self._pivot_mm)
        for moved in self._source.drain():
            self._join.put(moved)
        found = self._join.at(pose.host_time_s)
        return self._control.frame() if found is None else found.device_from_tip

    @property
    def is_in_nostril(self) -> bool:
        """Return whether the shaft has come to its pivot."""
        return not self._control.is_settling

    def _drop_waiting(self) -> None:
        """Forget where it was while the scope had the hand."""
        self._source.drain()
        self._join = PoseJoin()


class ClutchTurns(DeviceTurns):
    """Give an arm or a tracked tool to the tool: it follows the device's motion.

    A device cannot be in two places: each goes on from where it was, turned and
    shifted as the device turns and shifts from the moment that it was given over.
    """

    def __init__(self) -> None:
        self._scope: tuple[Doubles, Doubles] | None = None
        """Where scope and device were when the scope last got it."""
        self._tool: tuple[Doubles, Doubles] = np.eye(4), np.eye(4)
        self._last = np.eye(4)
        """The held scope, or the parked shaft."""

    def to_tool(self, shaft: Doubles, pose: Pose) -> None:
        """Hold the scope and follow the device with the tool from now on."""
        self._last = self.scope(pose).device_from_tip
        self._tool = shaft, self.world_from_device @ pose.device_from_tip
        self.is_tools = self.has_tool = True

    def to_scope(self, pose: Pose) -> None:
        """Leave the tool and follow the device with the scope from now on."""
        shaft = self.shaft(pose)
        self._scope = self._last, pose.device_from_tip
        self._last = shaft
        self.is_tools = False

    def scope(self, pose: Pose) -> Pose:
        """Return the scope's pose; that of the device until it was first given away."""
        if self.is_tools:
            return _with_frame(pose, self._last)
        if self._scope is None:
            return pose
        return _with_frame(pose, followed(*self._scope, pose.device_from_tip))

    def shaft(self, pose: Pose) -> Doubles:
        """Return the shaft's frame."""
        if not self.is_tools:
            return self._last
        return followed(*self._tool, self.world_from_device @ pose.device_from_tip)

    @property
    def is_in_nostril(self) -> bool:
        """Return False: it began where no nostril holds it."""
        return False


def followed(held: Doubles, before: Doubles, now: Doubles) -> Doubles:
    """Return where a frame goes that follows a device from one pose to another.

    All 4x4: it turns by the device's turn and its origin shifts by the device's shift.
    """
    frame = np.eye(4)
    frame[:3, :3] = now[:3, :3] @ before[:3, :3].T @ held[:3, :3]
    frame[:3, 3] = held[:3, 3] + now[:3, 3] - before[:3, 3]
    return frame


def _with_frame(pose: Pose, frame: Doubles) -> Pose:
    return Pose(pose.time_s, pose.host_time_s, frame, pose.buttons, pose.flags)
