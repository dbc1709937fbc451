"""What both hands feel of recorded samples, within an operation."""

from dataclasses import fields

import numpy as np
import pytest

from scenarios.endoscope import Endoscope
from scenarios.feeling import Feeling, FeltFigures
from scenarios.instrument_state import EMPTY_HAND, NO_TOOL
from surgery.force import NO_TOUCH
from tests.scenarios.recorded_hand import ABOVE, FLOOR_MM, Hand

PLACE = 12.0, 11.0


def pressing(hand: Hand, deep_mm: float, seconds: float = 2.0) -> Hand:
    """Push a ball probe down from 1 mm above the floor."""
    hand.step(name="ball probe", is_sucking=False)
    hand.tip_mm = (*PLACE, FLOOR_MM + 1.0)
    hand.go((*PLACE, FLOOR_MM - deep_mm), seconds, 60)
    return hand


def test_an_operation_tells_the_newest_touch() -> None:
    hand = pressing(Hand(), 0.2)
    touch = hand.operation.touch
    assert touch.is_touching
    assert touch.wall == "lamina papyracea"
    assert 0.2 <= touch.depth_mm < 0.6
    assert touch.newton[2] == pytest.approx(0.3 * touch.depth_mm, rel=0.01)
    assert not hand.operation.scope_touch.newton.any()
    assert hand.operation.figures().greatest_n == pytest.approx(touch.size_n, rel=0.02)


def test_figures_count_walls_that_broke() -> None:
    figures = pressing(Hand(), 6.0).operation.figures()
    assert figures.broken_walls == {"lamina papyracea": 1}
    assert 9.2 / 1.3 < figures.greatest_n < 9.2 * 1.35
    assert figures.scope_n == 0.0
    (told,) = figures.breaks
    assert (told.wall, told.by) == ("lamina papyracea", "ball probe")
    assert 0.0 < told.time_s <= 2.1
    assert 9.2 / 1.3 < told.force_n <= figures.greatest_n
    # by force alone nothing is taken
    assert figures.edits == 0


def test_an_empty_hand_feels_nothing() -> None:
    hand = pressing(Hand(), 0.6)
    hand.step(name=NO_TOOL)
    assert hand.operation.touch is NO_TOUCH
    hand.step(name="ball probe")
    assert hand.operation.touch.is_touching


def test_a_hole_stays_open_for_the_next_tool() -> None:
    hand = pressing(Hand(), 6.0)
    hand.tip_mm = (*PLACE, FLOOR_MM + 1.0)
    hand.step(1.0, name="suction tube")
    hand.step(1.0, name="ball probe")
    hand.go((*PLACE, FLOOR_MM - 2.0), 1.0, 60)
    assert hand.operation.touch.size_n < 1.0
    assert hand.operation.figures().broken_walls == {"lamina papyracea": 1}


def test_the_scope_feels_walls() -> None:
    feeling = Feeling(Hand().operation.patient)
    pose = ABOVE.copy()
    for n in range(61):
        pose[2, 3] = FLOOR_MM + 1.0 - 1.6 * n / 60
        feeling.step(n / 60, pose, 1.35, pose, EMPTY_HAND)
    assert feeling.scope.newton[2] == pytest.approx(0.18, rel=0.1)
    assert feeling.figures == FeltFigures(0.0, feeling.figures.scope_n, ())
    assert feeling.figures.scope_n > 0.17


@pytest.mark.parametrize("at", [30, 80, 115])
def test_an_operation_put_back_goes_on_to_the_bit(at: int) -> None:
    """Before, during and after a push that breaks the wall."""
    samples = pressing(Hand(), 6.0).samples
    hand = Hand()
    for sample in samples[:at]:
        hand.operation.step(sample, ABOVE, Endoscope())
    state = hand.operation.checkpoint()
    ends = []
    for _ in range(2):
        for sample in samples[at:]:
            hand.operation.step(sample, ABOVE, Endoscope())
        touch = hand.operation.touch
        ends.append([getattr(touch, each.name) for each in fields(touch)])
        ends.append([hand.operation.figures()])
        hand.operation.restore(state, Endoscope())
    for first, second in zip(ends[:2], ends[2:], strict=True):
        for one, other in zip(first, second, strict=True):
            assert np.array_equal(one, other)
