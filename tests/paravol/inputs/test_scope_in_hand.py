"""Scopes that are exchanged in flight."""

from dataclasses import replace

import numpy as np
import pytest

from devices import Pose
from paravol.inputs.instrument_controller import FIRST_AHEAD_MM
from paravol.inputs.scope_in_hand import ScopeInHand
from paravol.inputs.tool_plan import ASIDE_MM
from scenarios import Endoscope, Sample
from scenarios.scenario import ANGLES_DEG, Scope
from system import UserError
from tests.paravol.inputs.pointing import Bare, hand_before, settled, tip

POSE = Pose(0.0, 0.0, np.eye(4), 0)


BARE = Bare().complete(POSE)


def rolled(roll_deg: float) -> Sample:
    return replace(BARE, roll_deg=roll_deg)


def test_what_was_chosen_last_is_in_the_next_sample() -> None:
    scope = ScopeInHand(0.0, ANGLES_DEG)
    assert (scope.turn(BARE).scope_deg, scope.angle_deg) == (None, 0.0)
    scope.choose(45.0)
    assert (scope.turn(BARE).scope_deg, scope.angle_deg) == (45.0, 45.0)
    # the exercise's own is not told apart from one that nobody exchanged
    scope.choose(0.0)
    assert (scope.turn(BARE).scope_deg, scope.angle_deg) == (None, 0.0)


@pytest.mark.parametrize("by", [1, -1])
def test_steps_go_round_all_scopes(by: int) -> None:
    scope = ScopeInHand(30.0, ANGLES_DEG)
    seen = [scope.step(by) for _ in ANGLES_DEG]
    order = [30.0, 45.0, 70.0, 0.0, 30.0] if by > 0 else [30.0, 0.0, 70.0, 45.0, 30.0]
    assert seen == order[1:]


def test_a_recorded_scope_stays_until_somebody_chooses() -> None:
    # as a recording does
    recorded = replace(BARE, scope_deg=70.0)
    scope = ScopeInHand(0.0, ANGLES_DEG)
    assert (scope.turn(recorded).scope_deg, scope.angle_deg) == (70.0, 70.0)
    assert scope.step(1) == 0.0
    assert scope.turn(recorded).scope_deg is None


def test_an_exercise_may_have_fewer_scopes() -> None:
    fewer = Scope(angle_deg=30.0, angles_deg=(70.0,))
    assert fewer.choices_deg == (30.0, 70.0)
    assert Scope(angle_deg=10.0).choices_deg == (0.0, 10.0, 30.0, 45.0, 70.0)
    scope = ScopeInHand(30.0, fewer.choices_deg)
    with pytest.raises(UserError, match="no scope of 45°; it has 30°, 70°"):
        scope.choose(45.0)
    assert scope.turn(BARE).scope_deg is None


def test_the_light_post_turns_on_top_of_the_channel() -> None:
    scope, bare = ScopeInHand(), rolled(30.0)
    assert scope.turn(bare).roll_deg == 30.0
    scope.post_deg -= 5.0
    assert scope.turn(bare).roll_deg == 25.0


def test_a_camera_head_is_upright_until_it_is_turned() -> None:
    scope, bare = ScopeInHand(), rolled(30.0)
    assert scope.turn(bare).camera_roll_deg == 0.0
    scope.camera_deg -= 5.0
    sample = scope.turn(bare)
    assert (sample.camera_roll_deg, sample.roll_deg) == (-5.0, 30.0)


def test_a_clipped_camera_head_goes_along_with_the_light_post() -> None:
    scope, bare = ScopeInHand(follows_post=True, camera_deg=25.0), rolled(30.0)
    assert scope.turn(bare).camera_roll_deg == 25.0
    bare = rolled(110.0)
    scope.post_deg += 10.0
    assert scope.turn(bare).camera_roll_deg == 115.0
    scope.camera_deg += 90.0
    # no more than half a turn either way
    assert scope.turn(bare).camera_roll_deg == -155.0


def test_a_tool_goes_where_the_scope_in_hand_looks() -> None:
    scope = ScopeInHand(0.0, ANGLES_DEG)
    hand = hand_before(-40.0, "suction tube")
    hand.point(0.0, 0.0)
    time_s = 0.0
    for angle_deg in (0.0, 30.0, 45.0):
        scope.choose(angle_deg)
        time_s = settled(hand, time_s, scope=scope)
        camera = Endoscope(angle_deg=angle_deg).camera(np.eye(4), 0.0, (8, 8))
        expected = camera.frame[0] + FIRST_AHEAD_MM * camera.frame[3]
        off = np.linalg.norm(tip(hand, time_s + 0.01, scope) - expected)
        assert off < ASIDE_MM + 1.5
