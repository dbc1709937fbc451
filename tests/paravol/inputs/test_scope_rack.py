"""Scopes that are exchanged in flight."""

from dataclasses import replace

import numpy as np
import pytest

from devices import Pose
from disk import UserError
from paravol.inputs.operating_hand import FIRST_AHEAD_MM
from paravol.inputs.scope_rack import ScopeRack
from paravol.inputs.tool_plan import ASIDE_MM
from scenarios import Endoscope, Sample
from scenarios.scenario import ANGLES_DEG, Scope
from tests.paravol.inputs.pointing import Bare, hand_before, settled, tip

POSE = Pose(0.0, 0.0, np.eye(4), 0)


class Recorded(Bare):
    """A channel that brings a scope of its own, as a recording does."""

    def complete(self, pose: Pose) -> Sample:
        return replace(super().complete(pose), scope_deg=70.0)


def test_what_was_chosen_last_is_in_the_next_sample() -> None:
    rack = ScopeRack(Bare(), 0.0, ANGLES_DEG)
    assert (rack.complete(POSE).scope_deg, rack.angle_deg) == (None, 0.0)
    rack.choose(45.0)
    assert (rack.complete(POSE).scope_deg, rack.angle_deg) == (45.0, 45.0)
    # the exercise's own is not told apart from one that nobody exchanged
    rack.choose(0.0)
    assert (rack.complete(POSE).scope_deg, rack.angle_deg) == (None, 0.0)


@pytest.mark.parametrize("by", [1, -1])
def test_steps_go_round_all_scopes(by: int) -> None:
    rack = ScopeRack(Bare(), 30.0, ANGLES_DEG)
    seen = [rack.step(by) for _ in ANGLES_DEG]
    order = [30.0, 45.0, 70.0, 0.0, 30.0] if by > 0 else [30.0, 0.0, 70.0, 45.0, 30.0]
    assert seen == order[1:]


def test_a_recorded_scope_stays_until_somebody_chooses() -> None:
    rack = ScopeRack(Recorded(), 0.0, ANGLES_DEG)
    assert (rack.complete(POSE).scope_deg, rack.angle_deg) == (70.0, 70.0)
    assert rack.step(1) == 0.0
    assert rack.complete(POSE).scope_deg is None


def test_an_exercise_may_have_fewer_scopes() -> None:
    scope = Scope(angle_deg=30.0, angles_deg=(70.0,))
    assert scope.choices_deg == (30.0, 70.0)
    assert Scope(angle_deg=10.0).choices_deg == (0.0, 10.0, 30.0, 45.0, 70.0)
    rack = ScopeRack(Bare(), 30.0, scope.choices_deg)
    with pytest.raises(UserError, match="no scope of 45°; it has 30°, 70°"):
        rack.choose(45.0)
    assert rack.complete(POSE).scope_deg is None


def test_a_tool_goes_where_the_scope_in_hand_looks() -> None:
    rack = ScopeRack(Bare(), 0.0, ANGLES_DEG)
    hand = hand_before(-40.0, "suction tube", rack)
    hand.point(0.0, 0.0)
    time_s = 0.0
    for angle_deg in (0.0, 30.0, 45.0):
        rack.choose(angle_deg)
        time_s = settled(hand, time_s)
        camera = Endoscope(angle_deg=angle_deg).camera(np.eye(4), 0.0, (8, 8))
        expected = camera.frame[0] + FIRST_AHEAD_MM * camera.frame[3]
        off = np.linalg.norm(tip(hand, time_s + 0.01) - expected)
        assert off < ASIDE_MM + 1.5
