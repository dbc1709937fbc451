"""The nostril holds the shaft, whatever the hand does."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.controls.fulcrum import (
    LAG_S,
    Demand,
    Fulcrum,
    FulcrumControl,
    FulcrumLimits,
    Hold,
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


def ceiling(most_mm: float) -> Hold:
    """A wall that lets no tip rise above a height; it moves the whole scope."""

    def hold(
        start: NDArray[np.float64], wanted: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        assert start.shape == (4, 4)
        if wanted[2, 3] <= most_mm:
            return wanted
        held = wanted.copy()
        held[2, 3] = most_mm
        return held

    return hold


@given(steps, st.floats(-5.0, 40.0))
def test_no_input_leads_a_scope_past_what_holds_it(
    sequence: list[tuple[float, Demand]], most_mm: float
) -> None:
    scope = FulcrumControl(FULCRUM, LIMITS, hold=ceiling(most_mm))
    for step_s, demand in sequence:
        scope.advance(step_s, demand)
        assert scope.frame()[2, 3] <= most_mm + 1e-9
        assert 2.0 <= scope.depth_mm <= 105.0
        assert scope.tilt_deg <= 35.0
        read_only_rigid(scope.frame(), "frame")


@given(steps)
def test_walls_that_are_not_touched_change_no_bit(
    sequence: list[tuple[float, Demand]],
) -> None:
    free, walled = control(), FulcrumControl(FULCRUM, LIMITS, hold=ceiling(1e3))
    for step_s, demand in sequence:
        free.advance(step_s, demand)
        walled.advance(step_s, demand)
        assert free.frame().tobytes() == walled.frame().tobytes()


@given(st.lists(st.tuples(st.just(0.01), rates), max_size=60))
def test_a_hand_goes_on_from_where_its_scope_was_held(
    sequence: list[tuple[float, Demand]],
) -> None:
    """What a wall refused need not be taken back; a free step is as of a new hand."""
    scope = FulcrumControl(FULCRUM, LIMITS, hold=ceiling(12.0))
    for step_s, demand in sequence:
        scope.advance(step_s, demand)
    held = scope.frame()[:3, 3]
    scope.advance(0.01, Demand(insert=-1.0))
    moved = scope.frame()[:3, 3] - held
    # as far as the hand goes, but for what the limits cut off
    assert np.linalg.norm(moved) <= LIMITS.insert_mm_s * 0.01 + 1e-6
    for _ in range(100):
        scope.advance(0.05, Demand(insert=-1.0))
    assert scope.depth_mm == pytest.approx(2.0)


def fast(
    start: NDArray[np.float64], wanted: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Walls on all sides."""
    del wanted
    return start


def test_a_wedged_scope_says_so_and_can_be_drawn_back() -> None:
    scope = FulcrumControl(FULCRUM, LIMITS, 40.0, fast)
    for _ in range(100):
        scope.advance(0.01, Demand(insert=1.0, yaw=0.5))
    was_wedged = scope.is_wedged
    before = scope.frame()[:3, 3].copy()
    for _ in range(50):
        scope.advance(0.01, Demand(insert=-1.0))
    assert (was_wedged, scope.is_wedged) == (True, False)
    way = scope.frame()[:3, 3] - before
    assert way @ scope.frame()[:3, 2] == pytest.approx(0.5 * LIMITS.insert_mm_s)


@pytest.mark.parametrize("hold", [None, fast])
def test_a_scope_goes_out_by_itself_until_somebody_pushes(hold: Hold | None) -> None:
    scope = FulcrumControl(FULCRUM, LIMITS, 60.0, hold)
    scope.go_out()
    for _ in range(100):
        scope.advance(0.01, Demand(yaw=1.0))
    assert scope.depth_mm == pytest.approx(60.0 - LIMITS.insert_mm_s)
    scope.advance(0.01, Demand(insert=0.1))
    deep = scope.depth_mm
    scope.advance(0.01, Demand())
    assert scope.depth_mm == deep
    scope.go_out()
    for _ in range(400):
        scope.advance(0.01, Demand())
    assert scope.depth_mm == LIMITS.depth_mm[0]


@given(steps, st.tuples(*[st.floats(-6.0, 6.0)] * 3))
def test_a_leaning_hand_turns_as_a_hand_may_and_rests_with_it(
    sequence: list[tuple[float, Demand]], off: tuple[float, float, float]
) -> None:
    aim = FULCRUM.pivot_mm + np.array(off)
    scope = FulcrumControl(FULCRUM, LIMITS, lean=lambda tip_mm: aim)
    for step_s, demand in sequence:
        before = scope.frame()
        scope.advance(step_s, demand)
        read_only_rigid(scope.frame(), "frame")
        turned = np.linalg.norm(np.cross(before[:3, 2], scope.frame()[:3, 2]))
        most = 2.0 * np.radians(LIMITS.turn_deg_s) * step_s
        assert turned <= most * 1.01 + 1e-9
        assert scope.tilt_deg <= LIMITS.cone_deg
        scope.let_go()
        before = scope.frame()
        scope.advance(step_s, Demand())
        assert np.array_equal(scope.frame(), before)


lies = st.tuples(
    *[st.floats(-6.0, 6.0)] * 3,
    st.floats(20.0, 90.0),
    *[st.floats(-20.0, 20.0)] * 2,
    st.floats(-179.0, 179.0),
)


def lying(lie: tuple[float, ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the frame of a shaft that a hand has brought somewhere, and its entry."""
    *off, depth_mm, yaw, pitch, roll = lie
    entry = FULCRUM.pivot_mm + np.array(off)
    scope = FulcrumControl(Fulcrum(entry, FULCRUM.axis), LIMITS, depth_mm)
    scope.advance(
        10.0, Demand(yaw_nudge_deg=yaw, pitch_nudge_deg=pitch, roll_nudge_deg=roll)
    )
    return scope.frame(), entry


@given(lies, lies, st.floats(0.0, 60.0))
@settings(max_examples=30)
def test_a_shaft_comes_to_lie_where_it_was_told_no_faster_than_a_hand(
    first: tuple[float, ...], second: tuple[float, ...], drawn_mm: float
) -> None:
    scope = FulcrumControl(FULCRUM, LIMITS)
    for lie in (first, second):
        frame, entry = lying(lie)
        scope.lay(frame, entry, drawn_mm)
        for _ in range(2000):
            before = scope.frame()
            scope.advance(0.01, Demand())
            now = scope.frame()
            most_deg = 0.01 * LIMITS.turn_deg_s * 1.01
            assert angle_deg(before[:3, 2], now[:3, 2]) <= most_deg
            if not scope.is_laid:
                break
        assert not scope.is_laid
        assert np.abs(scope.frame() - frame).max() < 0.5
        assert np.allclose(scope.entry_mm, entry, atol=0.5)


@pytest.mark.parametrize("asked", [Demand(yaw=0.1), Demand(insert_nudge_mm=-1.0)])
def test_whoever_moves_a_shaft_that_is_laid_has_it(asked: Demand) -> None:
    scope, (frame, entry) = (
        FulcrumControl(FULCRUM, LIMITS),
        lying((0.0,) * 3 + (60.0, 9.0, 0.0, 0.0)),
    )
    scope.lay(frame, entry, 30.0)
    scope.advance(0.01, Demand())
    assert scope.is_laid
    scope.advance(0.01, asked)
    assert not scope.is_laid


def test_a_shaft_that_walls_hold_is_not_laid_for_ever() -> None:
    scope = FulcrumControl(FULCRUM, LIMITS, 40.0, lambda start, wanted: start)
    frame, entry = lying((0.0,) * 3 + (60.0, 9.0, 0.0, 0.0))
    scope.lay(frame, entry, 30.0)
    for _ in range(3000):
        scope.advance(0.01, Demand())
    assert not scope.is_laid
