"""A scope at the origin that looks along -z at a wall, and a hand beside it."""

import numpy as np
from numpy.typing import NDArray

from devices import Pose
from devices.controls.fulcrum import Fulcrum
from paravol.inputs.instrument_controller import InstrumentController
from paravol.inputs.pointed_tool import PointedTool
from paravol.inputs.scope_in_hand import ScopeInHand
from paravol.inputs.second_channel import SecondChannel
from paravol.inputs.tool_hold import ToolHold
from renderers.scene import Volume
from scenarios import Endoscope, Sample
from scenarios.instrument_state import EMPTY_HAND
from scenarios.instruments.contact_shape import shaft_mm

SPACING_MM = 0.5
SCOPE = Endoscope()
FULCRUM = Fulcrum(
    np.array([0.0, -2.0, 40.0]), np.array([0.0, 0.0, -1.0]), np.array([0.0, -1.0, 0.0])
)


class Bare:
    """A channel that knows no second hand."""

    def complete(self, pose: Pose) -> Sample:
        away = np.array([0.0, 1.0, 0.0])
        return Sample(pose.time_s, pose.device_from_tip, 0.0, away, away, 0, EMPTY_HAND)


def wall_at(z_mm: float) -> Volume:
    """Air above a plane."""
    z = np.arange(-60.0, 70.0, SPACING_MM)
    distance = np.broadcast_to((z_mm - z)[:, None, None], (len(z), 80, 80))
    values = np.ascontiguousarray(distance, np.float32)
    origin = np.array([-20.0, -20.0, -60.0])
    return Volume(values, np.full(3, SPACING_MM), origin, background=-100.0)


def hand_before(z_mm: float, tool: str = "straight forceps") -> InstrumentController:
    """Return a hand with a tool before a wall."""
    hand = InstrumentController(SCOPE)
    distance = wall_at(z_mm)
    hold = ToolHold(distance, FULCRUM.pivot_mm)
    hand.pointed = PointedTool(FULCRUM, hold, distance)
    hand.choose(tool)
    return hand


def settled(
    hand: InstrumentController,
    begin_s: float = 0.0,
    for_s: float = 3.0,
    scope: ScopeInHand | None = None,
) -> float:
    """Let samples pass; return the time of the last one."""
    time_s = begin_s
    for _ in range(round(100 * for_s)):
        time_s += 0.01
        tip(hand, time_s, scope)
    return time_s


def reached(
    tool: str = "straight forceps",
) -> tuple[InstrumentController, PointedTool, float]:
    """Return a hand whose tool came to the wall at -14 mm, the tool, and the time."""
    hand = hand_before(-14.0, tool)
    hand.point(0.0, -0.4)
    hand.advance(20.0)
    time_s = settled(hand)
    assert hand.pointed is not None
    return hand, hand.pointed, time_s


def joined(
    hand: InstrumentController, pose: Pose, scope: ScopeInHand | None = None
) -> Sample:
    """Return the sample of a pose with what the hands hold."""
    return SecondChannel(Bare(), scope or ScopeInHand(), hand).join(pose)


def tip(
    hand: InstrumentController, time_s: float, scope: ScopeInHand | None = None
) -> NDArray[np.float64]:
    """Return where the tool's tip is at a time, ``(3,)``."""
    sample = joined(hand, Pose(time_s, time_s, np.eye(4), 0), scope)
    return sample.instrument_tip_mm


def shaft_of_tool(name: str, tool: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the frame of a tool's straight shaft, 4x4, of its own."""
    shaft = tool.copy()
    shaft[:3, 3] += tool[:3, :3] @ shaft_mm(name)
    return shaft
