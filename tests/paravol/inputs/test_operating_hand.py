"""A carried tool: it stops at tissue, and its jaw moves in the samples' time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices import Pose
from disk import UserError
from paravol.inputs.jaw import CLOSING_S
from paravol.inputs.operating_hand import (
    FIRST_AHEAD_MM,
    NEAREST_MM,
    OperatingHand,
)
from paravol.inputs.tool_hold import BITES_MM
from renderers.scene import Volume
from scenarios import Endoscope, Sample
from scenarios.instrument_state import EMPTY_HAND, NO_TOOL

SPACING_MM = 0.5


class Bare:
    """A channel that knows no second hand."""

    def complete(self, pose: Pose) -> Sample:
        zero = np.zeros(3)
        return Sample(pose.time_s, pose.device_from_tip, 0.0, zero, zero, 0, EMPTY_HAND)


def wall_at(z_mm: float) -> Volume:
    """Air above a plane, seen by a scope at the origin that looks along -z."""
    z = np.arange(-60.0, 10.0, SPACING_MM)
    distance = np.broadcast_to((z_mm - z)[:, None, None], (len(z), 40, 40))
    values = np.ascontiguousarray(distance, np.float32)
    origin = np.array([-10.0, -10.0, -60.0])
    return Volume(values, np.full(3, SPACING_MM), origin, background=-100.0)


def hand_before(distance: Volume | None) -> OperatingHand:
    hand = OperatingHand(Bare(), Endoscope())
    hand.distance = distance
    hand.choose("straight forceps")
    return hand


def tip(hand: OperatingHand, time_s: float = 0.0) -> NDArray[np.float64]:
    sample = hand.complete(Pose(time_s, time_s, np.eye(4), 0))
    return sample.instrument_tip_mm


@given(st.floats(-50.0, -0.5), st.integers(-10, 30), st.booleans())
def test_the_tip_stops_at_tissue_and_works_as_far_in_as_a_bite(
    z_mm: float, steps: int, works: bool
) -> None:
    hand, free = hand_before(wall_at(z_mm)), hand_before(None)
    hand.work(works)
    hand.advance(float(steps))
    free.advance(float(steps))
    tip(hand)
    deep_mm = BITES_MM if works else 0.0
    wanted_mm = -tip(free)[2]
    found_mm = -tip(hand, 1.0)[2]
    assert found_mm == pytest.approx(min(wanted_mm, deep_mm - z_mm), abs=1e-3)


def test_only_listed_tools_can_be_taken() -> None:
    hand = OperatingHand(Bare(), Endoscope(), ("curette",))
    with pytest.raises(UserError, match="not allow the microdebrider"):
        hand.choose("microdebrider")
    hand.choose("curette")
    hand.choose(NO_TOOL)
    assert hand.tool == NO_TOOL


def test_what_tissue_held_back_does_not_gather() -> None:
    hand = hand_before(wall_at(-8.0))
    held = tip(hand)
    for _ in range(20):
        hand.advance(1.0)
        np.testing.assert_array_equal(tip(hand), held)
    hand.advance(-1.0)
    assert held[2] + 1.0 == pytest.approx(tip(hand)[2], abs=1e-6)


def test_it_goes_on_where_tissue_was_taken_away() -> None:
    hand = hand_before(None)
    for z_mm in (-8.0, -11.0):
        hand.distance = wall_at(z_mm)
        assert tip(hand)[2] == pytest.approx(z_mm, abs=1e-3)
    hand.distance = None
    assert -tip(hand)[2] == pytest.approx(FIRST_AHEAD_MM)
    hand.advance(-100.0)
    assert -tip(hand)[2] == pytest.approx(NEAREST_MM)


def test_jaws_close_while_the_pedal_is_down() -> None:
    hand = hand_before(None)

    def jaw(time_s: float) -> float:
        return hand.complete(Pose(time_s, time_s, np.eye(4), 0)).instrument.jaw

    assert jaw(0.0) == 0.0
    hand.work(True)
    assert jaw(CLOSING_S / 2) == pytest.approx(0.5)
    assert jaw(10.0) == 1.0
    hand.work(False)
    assert jaw(10.1) < 1.0
    assert jaw(20.0) == 0.0
