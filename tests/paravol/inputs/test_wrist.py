"""The wrist of a mouse: tools face what is pointed at, jaws open as walls let them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from anatomy.tissue import Label
from paravol.inputs.tool_hold import OPENS_MM, ToolHold, tool_of_shaft
from paravol.inputs.wrist import Wrist
from renderers.scene import Volume
from scenarios import InstrumentState, tip_frame
from scenarios.instruments import INSTRUMENTS
from scenarios.instruments.contact_shape import (
    contact_table,
    placed_table,
    shaft_mm,
    works_at_mm,
)

H = 0.5
AXIS = (np.arange(121) - 60) * H
ALONG = np.array([0.0, 0.0, -1.0])
TIP = np.array([0.0, 0.0, -5.0])
BITING = [name for name, tool in INSTRUMENTS.items() if tool.has_jaws]
BESIDE = [name for name in INSTRUMENTS if works_at_mm(name).any()]


def volume(values: NDArray[np.float64]) -> Volume:
    filled = np.ascontiguousarray(np.broadcast_to(values, (121, 121, 121)), np.float32)
    return Volume(filled, np.full(3, H), np.full(3, AXIS[0]), background=-90.0)


def channel(half_mm: float, turn: float = 0.0) -> Volume:
    """Air along z between two walls, whose normal is turned about z."""
    off = math.cos(turn) * AXIS + math.sin(turn) * AXIS[:, None]
    return volume(np.abs(off) - half_mm)


def faced(frame: NDArray[np.float64], roll_deg: float) -> NDArray[np.float64]:
    facing: NDArray[np.float64] = tip_frame(frame[:3, 3], ALONG, roll_deg)[:3, 1]
    return facing


@given(st.floats(-math.pi, math.pi), st.floats(-180.0, 180.0))
@settings(max_examples=30, deadline=None)
def test_a_tool_faces_the_wall_that_is_pointed_at(turn: float, now: float) -> None:
    """However the wall stands about it: y of a tool is where it works."""
    normal = np.array([math.cos(turn), math.sin(turn), 0.0])
    wall = volume(normal[0] * AXIS + normal[1] * AXIS[:, None] - 4.0)
    frame = tip_frame(TIP, ALONG, now)
    roll = Wrist(wall).turn_deg("microdebrider", frame, TIP + 4.0 * normal, now)
    assert faced(frame, roll) @ normal == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("name", BITING)
@given(st.floats(-math.pi, math.pi))
@settings(max_examples=10, deadline=None)
def test_jaws_turn_to_hold_what_is_pointed_at_and_spare_the_rest(
    name: str, turn: float
) -> None:
    """Between two tissues they hold less of the other than turned anyhow."""
    normal = np.array([math.cos(turn), math.sin(turn), 0.0])
    across = normal[0] * AXIS + normal[1] * AXIS[:, None]
    labels = volume(np.where(across > 0.0, Label.UNCINATE, Label.MIDDLE_TURBINATE))
    distance = channel(1.0, turn)
    wrist = Wrist(distance, labels.with_values(labels.values.astype(np.uint8), 0))
    frame = tip_frame(TIP, ALONG)
    roll = wrist.turn_deg(name, frame, TIP + normal, 0.0)

    def other(turned_deg: float) -> int:
        tool = tool_of_shaft(name, tip_frame(TIP, ALONG, turned_deg))
        rows = INSTRUMENTS[name].working_volume(tool, 0.25)
        ends = rows[:, 1:7].reshape(-1, 3) @ normal
        return int((ends < -1.0).sum())

    assert other(roll) <= np.mean([other(deg) for deg in range(0, 360, 15)]) + 1e-9


@pytest.mark.parametrize("name", BITING)
def test_jaws_open_as_far_as_walls_let_them(name: str) -> None:
    """Wider channels let them open farther, and none presses deeper than it may."""
    frame = tip_frame(TIP, ALONG, 90.0)
    closed = []
    for half_mm in (2.0, 2.5, 3.0, 4.0, 5.0, 8.0, 12.0):
        air = channel(half_mm)
        hold = ToolHold(air, np.array([0.0, 0.0, 20.0]))
        hold.state = InstrumentState(name, jaw=1.0)
        jaw = hold.narrow(frame)
        closed.append(jaw)
        deep, shut = (_deepest(air, name, at, frame) for at in (jaw, 1.0))
        assert deep <= max(OPENS_MM, shut) + 0.1
    assert closed == sorted(closed, reverse=True)
    assert closed[-1] == 0.0
    assert closed[0] > 0.0


def _deepest(air: Volume, name: str, jaw: float, frame: NDArray[np.float64]) -> float:
    table = placed_table(contact_table(name, jaw), tool_of_shaft(name, frame))
    ends = np.concatenate([table[:, :3], table[:, 3:6]])
    return float((air.sample(ends) + np.tile(table[:, 6], 2)).max())


@pytest.mark.parametrize("name", BESIDE)
def test_what_works_beside_its_shaft_bites_there(name: str) -> None:
    place = works_at_mm(name)
    assert place[0] == 0.0
    assert place[1] > float(np.abs(shaft_mm(name)[:2]).max())
    rows = INSTRUMENTS[name].working_volume(np.eye(4), 0.25)
    ends = rows[:, 1:7].reshape(-1, 3)
    assert (ends.min(axis=0) <= place + 1e-9).all()
    assert (place <= ends.max(axis=0) + 1e-9).all()
