"""The second hand: what it takes, and its jaw in the samples' time."""

from unittest.mock import patch

import numpy as np
import pytest

from devices import Pose
from paravol.inputs.instrument_controller import InstrumentController
from paravol.inputs.pointed_tool import SHUT
from paravol.inputs.tool_plan import PRESSED_MM
from scenarios import Endoscope
from scenarios.instrument_state import NO_TOOL
from system import UserError
from tests.paravol.inputs.pointing import hand_before, joined, reached, settled


def test_only_listed_tools_can_be_taken() -> None:
    hand = InstrumentController(Endoscope(), ("curette",))
    with pytest.raises(UserError):
        hand.choose("microdebrider")
    hand.choose("curette")
    hand.choose(NO_TOOL)
    assert hand.tool == NO_TOOL


def test_where_no_nostril_is_known_there_is_no_tool() -> None:
    hand = InstrumentController(Endoscope())
    hand.choose("curette")
    sample = joined(hand, Pose(0.0, 0.0, np.eye(4), 0))
    assert sample.instrument.name == NO_TOOL


def test_jaws_stay_closed_but_for_a_bite() -> None:
    """On the way in the pedal does nothing; then they go in, open, close."""
    hand = hand_before(-14.0)
    hand.point(0.0, -0.4)
    hand.advance(20.0)
    hand.work(True)
    sample = joined(hand, Pose(0.2, 0.2, np.eye(4), 0))
    assert not sample.instrument.is_working
    assert sample.instrument.jaw == SHUT
    hand.work(False)
    end_s = settled(hand)
    idle = joined(hand, Pose(end_s + 0.01, end_s + 0.01, np.eye(4), 0))
    told = hand.at_bite(idle)
    assert idle.instrument.jaw == SHUT
    assert told.instrument.jaw < 0.5
    hand.work(True)
    jaws, tips = [], []
    for number in range(2, 150):
        time_s = end_s + 0.01 * number
        sample = joined(hand, Pose(time_s, time_s, np.eye(4), 0))
        jaws.append(sample.instrument.jaw)
        tips.append(sample.instrument_tip_mm)
    opened = int(np.argmin(jaws))
    assert jaws[opened] == pytest.approx(told.instrument.jaw, abs=0.1)
    assert jaws[-1] == 1.0
    # what is told before a bite is told of where it closes
    for tip_mm in tips[opened:]:
        assert tip_mm == pytest.approx(told.instrument_tip_mm, abs=1e-6)
    hand.work(False)
    end_s = settled(hand, time_s)
    after = joined(hand, Pose(end_s + 0.01, end_s + 0.01, np.eye(4), 0))
    assert after.instrument.jaw == SHUT
    assert after.instrument_tip_mm == pytest.approx(idle.instrument_tip_mm, abs=1.0)


@pytest.mark.parametrize("step_s", [0.01, 0.05, 0.13])
@pytest.mark.parametrize("steps", [2, 4, 7, 12, 30])
def test_open_jaws_lie_nowhere_but_where_they_bite(step_s: float, steps: int) -> None:
    """However long pictures take, and whenever the pedal is let go."""
    hand, _, time_s = reached()
    told = hand.at_bite(joined(hand, Pose(time_s, time_s, np.eye(4), 0)))
    for number in range(steps + 20):
        hand.work(number < steps)
        time_s += step_s
        sample = joined(hand, Pose(time_s, time_s, np.eye(4), 0))
        off_mm = np.linalg.norm(sample.instrument_tip_mm - told.instrument_tip_mm)
        assert sample.instrument.jaw > SHUT - 0.04 or off_mm < 1e-6


PRESSED_S = 1.5


def opens(hand: InstrumentController, time_s: float) -> bool:
    """Press the pedal for a while; return whether the jaws open for a bite."""
    hand.work(True)
    jaws = []
    for at_s in time_s + np.arange(0.01, PRESSED_S + 0.005, 0.01):
        sample = joined(hand, Pose(at_s, at_s, np.eye(4), 0))
        jaws.append(sample.instrument.jaw)
    hand.work(False)
    return bool(min(jaws) < 0.5)


@pytest.mark.parametrize(("away", "after_s"), [(0.05, 0.02), (0.12, 0.2), (0.16, 0.1)])
def test_a_pedal_bites_what_was_told_before_a_tremor(
    away: float, after_s: float
) -> None:
    """A hand that trembles as it presses means what it was told of."""
    hand, _, end_s = reached()
    hand.point(away, -0.4)
    end_s = settled(hand, end_s, after_s)
    assert hand.pointed is not None
    # farther off another bite is told, or none yet
    assert (hand.pointed.bite is None) == (away > 0.15)
    assert opens(hand, end_s)


@pytest.mark.parametrize("away", [0.02, 0.05, 0.08])
def test_what_was_told_is_what_is_bitten(away: float) -> None:
    """A tremor between the figures and the press makes another bite of it."""
    hand, _, time_s = reached()
    told = hand.at_bite(joined(hand, Pose(time_s, time_s, np.eye(4), 0)))
    hand.point(away, -0.4)
    time_s = settled(hand, time_s, 0.25)
    hand.work(True)
    tips = []
    for at_s in time_s + np.arange(0.01, PRESSED_S, 0.01):
        sample = joined(hand, Pose(at_s, at_s, np.eye(4), 0))
        if sample.instrument.jaw == 1.0:
            tips.append(sample.instrument_tip_mm)
    assert tips[-1] == pytest.approx(told.instrument_tip_mm, abs=1e-6)


def test_a_tool_that_has_left_does_not_come_back_to_bite() -> None:
    """It would come by no way that was looked at; the pointer stays where it was."""
    hand, pointed, end_s = reached()
    assert pointed.bite is not None
    hand.is_scope_laid = lambda: True
    end_s = settled(hand, end_s, 0.2)
    assert not opens(hand, end_s)


def test_a_pedal_that_is_pressed_on_the_way_elsewhere_bites_nothing() -> None:
    """Nobody was told what it would be; let go and pressed there it does."""
    hand, _, end_s = reached()
    hand.point(0.5, 0.4)
    for on_the_way_s, bites in ((0.05, False), (3.0, True)):
        end_s = settled(hand, end_s, on_the_way_s)
        assert opens(hand, end_s) is bites
        end_s += PRESSED_S


def shaver_at_wall() -> tuple[InstrumentController, float]:
    """Return a hand whose shaver has come, and the time of its last sample."""
    hand = hand_before(-14.0, "microdebrider")
    hand.suck(True)
    hand.point(0.0, -0.4)
    hand.advance(20.0)
    return hand, settled(hand)


def test_a_shaver_takes_one_layer_at_a_time_as_was_told() -> None:
    """However much of the wall is gone by then; pressed anew it goes on."""
    hand, end_s = shaver_at_wall()
    assert hand.pointed is not None
    wall, tips = hand.pointed._distance.values, []
    for _ in range(2):
        idle = joined(hand, Pose(end_s + 0.01, end_s + 0.01, np.eye(4), 0))
        told_mm = hand.at_bite(idle).instrument_tip_mm
        way_mm = float(np.linalg.norm(told_mm - idle.instrument_tip_mm))
        assert way_mm == pytest.approx(hand.pointed._pose.bite_mm)
        assert way_mm in PRESSED_MM
        hand.work(True)
        # all that is before it comes away
        wall.setflags(write=True)
        wall -= 8.0
        for at_s in end_s + np.arange(0.02, 2.0, 0.01):
            sample = joined(hand, Pose(at_s, at_s, np.eye(4), 0))
            off = np.linalg.norm(sample.instrument_tip_mm - idle.instrument_tip_mm)
            assert off < way_mm + 0.3
        assert np.linalg.norm(sample.instrument_tip_mm - told_mm) < 0.3
        tips.append(sample.instrument_tip_mm)
        hand.work(False)
        end_s = settled(hand, end_s + 2.0)
    assert np.linalg.norm(tips[1] - tips[0]) > 5.0


def test_a_stroke_goes_to_nothing_nearer_that_comes_before_the_pointer() -> None:
    hand, end_s = shaver_at_wall()
    idle = joined(hand, Pose(end_s + 0.01, end_s + 0.01, np.eye(4), 0))
    told_mm = hand.at_bite(idle).instrument_tip_mm
    hand.work(True)
    joined(hand, Pose(end_s + 0.02, end_s + 0.02, np.eye(4), 0))
    assert hand.pointed is not None
    with patch("paravol.inputs.pointed_tool.reach_mm", lambda *_: 8.0):
        for at_s in end_s + np.arange(0.03, 1.5, 0.01):
            sample = joined(hand, Pose(at_s, at_s, np.eye(4), 0))
    assert np.linalg.norm(sample.instrument_tip_mm - told_mm) < 0.3
