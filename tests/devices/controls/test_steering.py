"""What hands ask for does not depend on when it is asked."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.controls.fulcrum import Demand
from devices.controls.steering import LONGEST_LOG, Axis, Steering

changes = st.lists(
    st.tuples(st.floats(0.0, 0.999), st.sampled_from(list(Axis)), st.floats(-1.0, 1.0)),
    max_size=20,
).map(lambda rows: sorted(rows, key=lambda row: row[0]))
cuts = st.lists(st.floats(0.001, 0.999), max_size=15, unique=True).map(sorted)


@given(changes, changes, cuts)
@settings(deadline=None)
def test_ways_are_integrals_over_exact_times(
    held: list[tuple[float, Axis, float]],
    nudged: list[tuple[float, Axis, float]],
    cuts: list[float],
) -> None:
    steering = Steering()
    for at_s, axis, rate in held:
        steering.hold(axis, rate, at_s)
    for at_s, axis, way in nudged:
        steering.nudge(axis, way, at_s + 1.0)
    edges = [0.0, *cuts, 1.0, 2.5]
    ways, nudges = [0.0] * 4, [0.0] * 4
    for start, end in itertools.pairwise(edges):
        demand, _ = steering.step(start, end)
        for axis in Axis:
            ways[axis] += demand[axis] * (end - start)
            nudges[axis] += demand[4 + axis]
    for axis in Axis:
        mine = [(at, rate) for at, what, rate in held if what == axis]
        ends = [*(at for at, _ in mine), 2.5][1:]
        area = sum(
            rate * (end - at) for (at, rate), end in zip(mine, ends, strict=True)
        )
        assert ways[axis] == pytest.approx(area, abs=1e-9)
        way = sum(way for _, what, way in nudged if what == axis)
        assert nudges[axis] == pytest.approx(way, abs=1e-9)


def test_a_key_tapped_between_two_steps_is_not_lost() -> None:
    steering = Steering()
    steering.press(1, True, 0.002)
    steering.hold(Axis.YAW, 1.0, 0.002)
    steering.press(1, False, 0.004)
    steering.hold(Axis.YAW, 0.0, 0.004)
    demand, buttons = steering.step(0.0, 0.01)
    assert demand.yaw == pytest.approx(0.2)
    assert buttons == 1
    assert steering.step(0.01, 0.02) == (Demand(), 0)


def test_buttons_stay_down_until_they_are_released() -> None:
    steering = Steering()
    steering.press(2, True, 0.5)
    assert [steering.step(t, t + 0.4)[1] for t in (0.0, 0.4, 0.8)] == [0, 2, 2]
    steering.press(2, False, 1.25)
    assert steering.step(1.2, 1.6)[1] == 2
    assert steering.step(1.6, 2.0)[1] == 0


def test_events_from_before_the_first_step_count_at_its_start() -> None:
    steering = Steering()
    steering.hold(Axis.INSERT, 0.5, -100.0)
    assert steering.step(0.0, 2.0)[0].insert == pytest.approx(0.5)


def test_a_log_that_nobody_reads_forgets_strokes_but_no_held_key() -> None:
    steering = Steering()
    steering.hold(Axis.ROLL, 1.0, 0.0)
    steering.press(1, True, 0.0)
    for i in range(LONGEST_LOG + 100):
        steering.nudge(Axis.YAW, 1.0, 0.001 * i)
    demand, buttons = steering.step(1000.0, 1001.0)
    assert demand.roll == pytest.approx(1.0)
    assert demand.yaw_nudge_deg == LONGEST_LOG
    assert buttons == 1


def test_what_no_hand_can_ask_is_refused() -> None:
    steering = Steering()
    with pytest.raises(ValueError, match="nan"):
        steering.hold(Axis.YAW, math.nan, 0.0)
    with pytest.raises(ValueError, match="inf"):
        steering.nudge(Axis.YAW, math.inf, 0.0)
    with pytest.raises(ValueError, match="time"):
        steering.hold(Axis.YAW, 1.0, math.nan)
    with pytest.raises(ValueError, match="step"):
        steering.step(1.0, 1.0)
