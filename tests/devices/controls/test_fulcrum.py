"""The nostril holds the shaft, whatever the hand does."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.controls.fulcrum import (
    LAG_S,
    Demand,
    Fulcrum,
    FulcrumControl,
    FulcrumLimits,
    Walls,
)
from devices.pose import read_only_rigid

LIMITS = FulcrumLimits(depth_mm=(2.0, 105.0), cone_deg=35.0)
FULCRUM = Fulcrum(np.array((-6.3, -13.0, -6.5)), np.array((0.0, 0.86, 0.5)))

wild = st.floats(-1e9, 1e9)
demands = st.tuples(*([wild] * 8)).map(lambda row: Demand(*row))
rates = st.tuples(*([st.floats(-1.0, 1.0)] * 4)).map(lambda row: Demand(*row))
steps = st.lists(st.tuples(st.floats(0.0, 0.5), demands), max_size=15)


def control() -> FulcrumControl:
    return FulcrumControl(FULCRUM, LIMITS)


def angle_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b)))


@given(steps)
def test_the_shaft_passes_through_the_fulcrum_for_every_input(
    sequence: list[tuple[float, Demand]],
) -> None:
    scope = control()
    for step_s, demand in sequence:
        scope.advance(step_s, demand)
        frame = scope.frame()
        rotation, tip = frame[:3, :3], frame[:3, 3]
        read_only_rigid(frame, "frame")
        assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-14
        assert np.linalg.det(rotation) > 0.0
        # Distance of the fulcrum from the shaft's line, and its place along it.
        arm = FULCRUM.pivot_mm - tip
        assert np.linalg.norm(np.cross(arm, rotation[:, 2])) < 1e-9
        assert 2.0 - 1e-9 <= arm @ rotation[:, 2] <= 105.0 + 1e-9
        assert 2.0 <= scope.depth_mm <= 105.0
        assert scope.tilt_deg <= 35.0
        assert angle_deg(-rotation[:, 2], FULCRUM.axis) <= 35.0 + 1e-9
        assert abs(scope.roll_deg) <= 180.0


@given(steps)
def test_no_step_is_faster_than_the_limits(
    sequence: list[tuple[float, Demand]],
) -> None:
    scope = control()
    for step_s, demand in sequence:
        depth, pointing, roll = scope.depth_mm, scope.pointing, scope.roll_deg
        scope.advance(step_s, demand)
        assert abs(scope.depth_mm - depth) <= LIMITS.insert_mm_s * step_s + 1e-9
        turned = angle_deg(scope.pointing, pointing)
        assert turned <= LIMITS.turn_deg_s * step_s + 1e-6
        rolled = abs(math.remainder(scope.roll_deg - roll, 360.0))
        assert rolled <= LIMITS.roll_deg_s * step_s + 1e-9


@given(steps, st.sampled_from(range(8)), st.sampled_from([math.nan, math.inf]))
def test_a_demand_that_is_not_finite_changes_nothing(
    sequence: list[tuple[float, Demand]], which: int, value: float
) -> None:
    scope = control()
    for step_s, demand in sequence:
        scope.advance(step_s, demand)
    before = scope.frame()
    asked = [0.5] * 8
    asked[which] = value
    with pytest.raises(ValueError, match="finite"):
        scope.advance(0.01, Demand(*asked))
    with pytest.raises(ValueError, match="step_s"):
        scope.advance(math.nan, Demand())
    assert np.array_equal(scope.frame(), before)


@given(rates, st.integers(1, 50))
def test_held_rates_travel_their_time_however_it_is_cut(
    demand: Demand, pieces: int
) -> None:
    whole, cut = control(), control()
    whole.advance(0.4, demand)
    for _ in range(pieces):
        cut.advance(0.4 / pieces, demand)
    assert np.allclose(whole.frame(), cut.frame(), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("demand", "moved"),
    [
        (Demand(insert=1.0), ("depth", 1.0)),
        (Demand(yaw=1.0), ("right", 1.0)),
        (Demand(pitch=1.0), ("up", 1.0)),
    ],
)
def test_positive_is_in_right_and_up(demand: Demand, moved: tuple[str, float]) -> None:
    scope = control()
    scope.advance(1.0, Demand(insert=1.0))
    before = scope.frame()
    scope.advance(0.1, demand)
    step = before[:3, :3].T @ (scope.frame()[:3, 3] - before[:3, 3])
    which = ("right", "up", "depth").index(moved[0])
    along = np.array((step[0], step[1], -step[2]))
    assert int(np.argmax(np.abs(along))) == which
    assert along[which] > 0.0


def test_clockwise_turns_the_top_of_the_scope_to_the_right() -> None:
    scope = control()
    upright = scope.frame()
    scope.advance(1.0, Demand(roll=1.0))
    assert scope.roll_deg == pytest.approx(90.0)
    assert scope.frame()[:3, 1] == pytest.approx(upright[:3, 0])
    assert scope.frame()[:3, 2] == pytest.approx(upright[:3, 2])


def test_a_scope_that_is_not_rolled_is_upright() -> None:
    scope = control()
    for demand in (Demand(yaw=0.7, pitch=0.4), Demand(yaw=-0.2, pitch=0.9)):
        scope.advance(0.6, demand)
        assert scope.frame()[2, 0] == pytest.approx(0.0, abs=1e-15)
        assert scope.frame()[2, 1] > 0.0


def test_a_stroke_is_followed_at_the_limit_and_then_left() -> None:
    scope = control()
    scope.advance(0.01, Demand(insert_nudge_mm=1e6))
    start = scope.depth_mm
    for _ in range(1000):
        scope.advance(0.01, Demand())
    assert scope.depth_mm - start == pytest.approx(LIMITS.insert_mm_s * LAG_S)
    small = control()
    small.advance(0.01, Demand(yaw_nudge_deg=0.1, insert_nudge_mm=0.1))
    assert small.depth_mm - 2.0 == pytest.approx(0.1)
    assert small.tilt_deg == pytest.approx(0.1)


def test_the_cone_is_the_same_in_all_directions() -> None:
    for turn in np.linspace(0, 2 * np.pi, 24):
        scope = control()
        scope.advance(100.0, Demand(yaw=math.cos(turn), pitch=math.sin(turn)))
        assert angle_deg(scope.pointing, FULCRUM.axis) == pytest.approx(35.0)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: FulcrumLimits(depth_mm=(-1.0, 5.0)), "depth_mm"),
        (lambda: FulcrumLimits(depth_mm=(5.0, 5.0)), "depth_mm"),
        (lambda: FulcrumLimits(depth_mm=(0.0, math.nan)), "depth_mm"),
        (lambda: FulcrumLimits(cone_deg=90.0), "cone_deg"),
        (lambda: FulcrumLimits(turn_deg_s=0.0), "turn_deg_s"),
        (lambda: FulcrumLimits(insert_mm_s=math.nan), "insert_mm_s"),
        (lambda: Fulcrum(np.zeros(2), np.ones(3)), "pivot_mm"),
        (lambda: Fulcrum(np.zeros(3), np.zeros(3)), "axis"),
        (lambda: Fulcrum(np.full(3, np.nan), np.ones(3)), "pivot_mm"),
        (lambda: FulcrumControl(FULCRUM, LIMITS, depth_mm=1.0), "depth_mm"),
        (lambda: FulcrumControl(FULCRUM, LIMITS, depth_mm=math.nan), "depth_mm"),
        (
            lambda: FulcrumControl(Fulcrum(np.zeros(3), np.array((0.0, 0.3, 1.0)))),
            "cone",
        ),
    ],
)
def test_limits_and_fulcrums_that_cannot_be_are_named(make: object, named: str) -> None:
    assert callable(make)
    with pytest.raises(ValueError, match=named):
        make()


def tube(radius_mm: float, touch_mm: float | None = None) -> Walls:
    """A tunnel about the fulcrum's axis; the scope's tip is what must stay inside."""

    def gap_mm(frame: NDArray[np.float64]) -> float:
        off = np.cross(frame[:3, 3] - FULCRUM.pivot_mm, FULCRUM.axis)
        return radius_mm - float(np.linalg.norm(off))

    return Walls(gap_mm, 0.5, touch_mm)


@given(steps, st.floats(0.5, 20.0), st.sampled_from((None, 0.15)))
def test_no_input_pushes_the_scope_through_a_wall(
    sequence: list[tuple[float, Demand]], radius_mm: float, touch_mm: float | None
) -> None:
    """Nor past a limit, nor faster than one, nor off the fulcrum."""
    walls = tube(radius_mm, touch_mm)
    scope = FulcrumControl(FULCRUM, LIMITS, walls=walls)
    for step_s, demand in sequence:
        depth_mm, pointing = scope.depth_mm, scope.pointing
        scope.advance(step_s, demand)
        assert walls.gap_mm(scope.frame()) >= -walls.give_mm
        assert 2.0 <= scope.depth_mm <= 105.0
        assert scope.tilt_deg <= 35.0
        assert abs(scope.depth_mm - depth_mm) <= LIMITS.insert_mm_s * step_s + 1e-9
        turned = angle_deg(scope.pointing, pointing)
        assert turned <= LIMITS.turn_deg_s * step_s + 1e-6
        arm = FULCRUM.pivot_mm - scope.frame()[:3, 3]
        assert np.linalg.norm(np.cross(arm, scope.pointing)) < 1e-9


@given(steps)
def test_walls_that_are_not_touched_change_no_bit(
    sequence: list[tuple[float, Demand]],
) -> None:
    free, walled = control(), FulcrumControl(FULCRUM, LIMITS, walls=tube(1e3))
    for step_s, demand in sequence:
        free.advance(step_s, demand)
        walled.advance(step_s, demand)
        assert free.frame().tobytes() == walled.frame().tobytes()


@given(st.lists(st.tuples(st.just(0.01), rates), max_size=60))
def test_a_scope_can_be_pulled_out_from_wherever_it_is(
    sequence: list[tuple[float, Demand]],
) -> None:
    scope = FulcrumControl(FULCRUM, LIMITS, depth_mm=60.0, walls=tube(3.0))
    for step_s, demand in sequence:
        scope.advance(step_s, demand)
    for _ in range(1000):
        scope.advance(0.01, Demand(insert=-1.0))
    assert scope.depth_mm == pytest.approx(2.0)


def test_a_scope_that_is_pushed_aside_goes_on_along_the_wall() -> None:
    scope = FulcrumControl(FULCRUM, LIMITS, walls=tube(3.0))
    # As far to the side as the tunnel lets it, and then in: it is led to the middle.
    for _ in range(600):
        scope.advance(0.01, Demand(insert=1.0, yaw=0.3))
    assert scope.depth_mm > 100.0
    off = np.cross(scope.frame()[:3, 3] - FULCRUM.pivot_mm, FULCRUM.axis)
    assert np.linalg.norm(off) == pytest.approx(3.5, abs=0.05)


def test_a_touch_dents_a_wall_little_and_a_push_more() -> None:
    walls = tube(3.0, touch_mm=0.15)
    scope = FulcrumControl(FULCRUM, LIMITS, depth_mm=60.0, walls=walls)

    def go_on(seconds: float, demand: Demand) -> float:
        for _ in range(round(seconds / 0.01)):
            scope.advance(0.01, demand)
        return -walls.gap_mm(scope.frame())

    assert go_on(1.5, Demand(yaw=0.1)) == pytest.approx(0.15, abs=0.05)
    # along the wall it stays a touch
    assert go_on(0.5, Demand(insert=0.5)) < 0.25
    assert go_on(1.0, Demand(yaw=1.0)) == pytest.approx(0.5, abs=0.05)
    # and a hand that rests presses no longer
    assert go_on(3.0, Demand()) == pytest.approx(0.15, abs=0.05)
    for _ in range(1000):
        scope.advance(0.01, Demand(insert=-1.0))
    assert scope.depth_mm == pytest.approx(2.0)
