"""One device for scope and tool: given over and back without a jump of either."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices import Pose
from devices.controls.fulcrum import Fulcrum, FulcrumControl
from devices.controls.handover import Handover
from devices.controls.steering import Axis
from paravol.inputs.instrument_controller import InstrumentController
from paravol.inputs.pointed_tool import PointedTool
from paravol.inputs.pose_completer import HandChannel
from paravol.inputs.scope_in_hand import ScopeInHand
from paravol.inputs.second_channel import SecondChannel
from paravol.inputs.tool_hold import ToolHold, roll_deg, tool_of_shaft
from paravol.inputs.turns import ClutchTurns, SteeredTurns
from renderers.scene import Volume
from scenarios import Endoscope, Sample, tip_frame
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import INSTRUMENTS
from tests.paravol.inputs.pointing import shaft_of_tool

Doubles = NDArray[np.float64]

ways = st.tuples(*[st.floats(-1.0, 1.0)] * 5)
steps = st.lists(st.tuples(ways, st.booleans()), min_size=2, max_size=25)


def tool_in_air() -> PointedTool:
    fulcrum = Fulcrum(np.zeros(3), np.array([0.0, 1.0, 0.3]))
    return PointedTool(fulcrum, ToolHold(FREE, fulcrum.pivot_mm), FREE)


def moved(frame: Doubles, way: tuple[float, ...]) -> Doubles:
    pointing = -frame[:3, 2] + 0.02 * np.array([way[3], 0.0, way[4]])
    return tip_frame(frame[:3, 3] + np.array(way[:3]), pointing, 7.0)


def tool_frame_of(sample: Sample) -> Doubles:
    return tip_frame(
        sample.instrument_tip_mm, sample.instrument_pointing, sample.instrument.roll_deg
    )


@given(st.sampled_from(sorted(INSTRUMENTS)), steps)
@settings(max_examples=60)
def test_an_arm_moves_one_of_both_and_neither_jumps(
    name: str, script: list[tuple[tuple[float, ...], bool]]
) -> None:
    """Whoever has the device moves as it does; the other rests to the bit."""
    hand = InstrumentController(Endoscope())
    channel = SecondChannel(HandChannel(), ScopeInHand(), hand)
    hand.turns = turns = ClutchTurns()
    hand.pointed = tool_in_air()
    hand.let_point(False)
    hand.world_from_device = tip_frame(
        np.array([3.0, -2.0, 1.0]), np.array([1.0, 2, 3])
    )
    hand.choose(name)
    frame = tip_frame(np.array([1.0, 2.0, 3.0]), np.array([0.2, 1.0, 0.1]))
    last = channel.join(Pose(0.0, 0.0, frame, 0))
    was_placed = False
    for number, (way, swaps) in enumerate(script, 1):
        if swaps:
            # given over at rest: nothing may move
            assert hand.swap()
            now = channel.join(Pose(number - 0.5, 0.0, frame, 0))
            assert np.abs(now.device_from_tip - last.device_from_tip).max() < 1e-9
            assert np.abs(tool_frame_of(now) - tool_frame_of(last)).max() < 1e-9
            assert hand.holds_scope == turns.is_tools
            last, was_placed = now, True
        before, frame = frame, moved(frame, way)
        now = channel.join(Pose(float(number), 0.0, frame, 0))
        by_mm = np.linalg.norm(frame[:3, 3] - before[:3, 3])
        scope_mm = np.linalg.norm(
            now.device_from_tip[:3, 3] - last.device_from_tip[:3, 3]
        )
        shafts = [shaft_of_tool(name, tool_frame_of(each)) for each in (last, now)]
        tool_mm = np.linalg.norm(shafts[1][:3, 3] - shafts[0][:3, 3])
        if turns.is_tools:
            assert np.array_equal(now.device_from_tip, last.device_from_tip)
            assert tool_mm == pytest.approx(by_mm, abs=1e-9)
        else:
            assert scope_mm == pytest.approx(by_mm, abs=1e-9)
            if was_placed:
                assert tool_mm < 1e-9
        assert (
            np.abs(
                now.device_from_tip[:3, :3] @ now.device_from_tip[:3, :3].T - np.eye(3)
            ).max()
            < 1e-12
        )
        last = now


def test_without_a_tool_the_scope_keeps_its_device() -> None:
    hand = InstrumentController(Endoscope())
    channel = SecondChannel(HandChannel(), ScopeInHand(), hand)
    hand.turns = turns = ClutchTurns()
    hand.pointed = tool_in_air()
    frame = tip_frame(np.zeros(3), np.array([0.0, 1.0, 0.1]))
    channel.join(Pose(0.0, 0.0, frame, 0))
    assert not hand.swap()
    hand.choose("curette")
    channel.join(Pose(0.1, 0.0, frame, 0))
    assert hand.swap()
    channel.join(Pose(0.2, 0.0, frame, 0))
    assert hand.holds_scope
    hand.choose(NO_TOOL)
    sample = channel.join(Pose(0.3, 0.0, frame, 0))
    assert not turns.is_tools
    assert sample.instrument.name == NO_TOOL
    assert np.abs(sample.device_from_tip - frame).max() < 1e-12


@given(
    st.sampled_from(sorted(INSTRUMENTS)),
    st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    st.tuples(*[st.floats(-0.6, 0.6)] * 2),
    st.floats(-180.0, 180.0),
)
def test_a_tool_and_its_shaft_are_one(
    name: str, tip: tuple[float, ...], aside: tuple[float, ...], turn: float
) -> None:
    frame = tip_frame(np.array(tip), np.array([aside[0], 1.0, aside[1]]), turn)
    back = tool_of_shaft(name, shaft_of_tool(name, frame))
    assert np.abs(back - frame).max() < 1e-12
    again = tip_frame(frame[:3, 3], -frame[:3, 2], roll_deg(frame))
    assert np.abs(again - frame).max() < 1e-9


FREE = Volume(
    np.full((8, 8, 8), -90.0, np.float32), np.full(3, 40.0), -150.0 * np.ones(3)
)


@given(
    st.tuples(*[st.floats(-6.0, 6.0)] * 3),
    st.tuples(*[st.floats(-0.4, 0.4)] * 2),
    st.lists(st.sampled_from(list(Axis)), min_size=1, max_size=4),
)
@settings(max_examples=40)
def test_a_steered_tool_goes_from_where_it_was_carried_to_its_own_pivot(
    tip: tuple[float, ...], aside: tuple[float, ...], keys: list[Axis]
) -> None:
    """It never jumps, and in the end its line passes through the nostril."""
    fulcrum = Fulcrum(np.zeros(3), np.array([0.0, 1.0, 0.3]))
    hold = ToolHold(FREE, fulcrum.pivot_mm)
    control = FulcrumControl(fulcrum, hold=hold)
    begin = np.array(tip) + np.array([0.0, 40.0, 12.0])
    start = tip_frame(begin, np.array([aside[0], 1.0, 0.3 + aside[1]]), 20.0)
    control.place(start)
    assert np.abs(control.frame() - start).max() < 1e-12
    handover = Handover()
    handover.give(True, 0.0)
    for key in keys:
        handover.hold(key, 1.0, 0.0)
    limits, last = control.limits, start
    for tick in range(400):
        demand, _ = handover.tool.step(0.01 * tick, 0.01 * (tick + 1))
        control.advance(0.01, demand)
        now = control.frame()
        way = np.linalg.norm(now[:3, 3] - last[:3, 3])
        swing = np.radians(limits.turn_deg_s) * limits.depth_mm[1]
        assert way <= 0.01 * (3 * limits.insert_mm_s + 3 * swing)
        last = now
    assert not control.is_settling
    away = fulcrum.pivot_mm - last[:3, 3]
    off = away - (away @ last[:3, 2]) * last[:3, 2]
    assert np.linalg.norm(off) < 1e-6


def test_steered_turns_leave_what_they_do_not_move() -> None:
    fulcrum = Fulcrum(np.zeros(3), np.array([0.0, 1.0, 0.3]))
    hold = ToolHold(FREE, fulcrum.pivot_mm)
    control = FulcrumControl(fulcrum, hold=hold)
    handover = Handover()
    turns = SteeredTurns(handover, control, hold)
    pose = Pose(0.0, 0.0, np.eye(4), 0)
    shaft = tip_frame(np.array([0.0, 40.0, 12.0]), np.array([0.0, 1.0, 0.3]))
    turns.to_tool(shaft, pose)
    assert np.abs(turns.shaft(pose) - shaft).max() < 1e-12
    assert handover.is_tools
    handover.nudge(Axis.INSERT, 5.0, 0.0)
    turns.to_scope(pose)
    left = control.frame().copy()
    far = Pose(1e9, 1e9, np.eye(4), 0)
    assert np.array_equal(turns.shaft(far), left)
    assert turns.scope(pose) is pose
