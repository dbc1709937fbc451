"""The second hand: what it takes, and its jaw in the samples' time."""

import numpy as np
import pytest

from devices import Pose
from disk import UserError
from paravol.inputs.jaw import CLOSING_S
from paravol.inputs.operating_hand import OperatingHand
from scenarios import Endoscope
from scenarios.instrument_state import NO_TOOL
from tests.paravol.inputs.pointing import Bare, hand_before, settled


def test_only_listed_tools_can_be_taken() -> None:
    hand = OperatingHand(Bare(), Endoscope(), ("curette",))
    with pytest.raises(UserError):
        hand.choose("microdebrider")
    hand.choose("curette")
    hand.choose(NO_TOOL)
    assert hand.tool == NO_TOOL


def test_where_no_nostril_is_known_there_is_no_tool() -> None:
    hand = OperatingHand(Bare(), Endoscope())
    hand.choose("curette")
    sample = hand.complete(Pose(0.0, 0.0, np.eye(4), 0))
    assert sample.instrument.name == NO_TOOL


def test_jaws_open_in_place_and_close_while_the_pedal_is_down() -> None:
    hand = hand_before(-40.0)

    def jaw(time_s: float) -> float:
        return hand.complete(Pose(time_s, time_s, np.eye(4), 0)).instrument.jaw

    assert jaw(0.0) == 1.0
    hand.work(True)
    sample = hand.complete(Pose(0.2, 0.2, np.eye(4), 0))
    assert not sample.instrument.is_working
    assert sample.instrument.jaw == 1.0
    hand.work(False)
    end_s = settled(hand)
    assert jaw(end_s) == 0.0
    hand.work(True)
    assert jaw(end_s + CLOSING_S / 2) == pytest.approx(0.5)
    assert jaw(end_s + 1.0) == 1.0
    hand.work(False)
    assert jaw(end_s + 1.1) < 1.0
    assert jaw(end_s + 2.0) == 0.0
