"""Pedals: chatter gives clean edges, whatever its pattern."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.controls.pedals import (
    HOLD_S,
    Button,
    ButtonEvent,
    Debouncer,
    PressCollector,
)
from devices.pose import Pose, PoseFlag

RIGHT, LEFT = Button.RIGHT_PEDAL, Button.LEFT_PEDAL
LONG_AFTER_S = 1.0

Levels = list[tuple[float, int]]

# A chatter: raw levels of both pedals at rising times within less than the hold.
chatters = st.lists(
    st.tuples(st.floats(0.0, 0.0199), st.integers(0, 3)), min_size=1, max_size=40
).map(lambda rows: sorted(rows, key=lambda row: row[0]))

# Whole recordings: steps of time and levels of all seven bits.
streams = st.lists(
    st.tuples(st.floats(0.0, 0.08), st.integers(0, 127)), min_size=1, max_size=60
)


def edges(levels: Levels) -> list[ButtonEvent]:
    debouncer = Debouncer()
    return [event for at, raw in levels for event in debouncer.feed(at, raw)]


@given(chatters, st.integers(0, 3))
def test_a_chatter_gives_at_most_one_pair_and_ends_where_it_settles(
    chatter: Levels, settled: int
) -> None:
    told = edges([*chatter, (0.02, settled), (LONG_AFTER_S, settled)])
    for button in (RIGHT, LEFT):
        kinds = [event.is_down for event in told if event.button == button]
        assert kinds in ([], [True], [True, False])
        assert bool(kinds and kinds[-1]) == bool(settled & button)


@given(streams)
def test_edges_alternate_in_order_and_keep_their_distance(stream: Levels) -> None:
    at_s = 0.0
    levels = []
    for step_s, raw in stream:
        at_s += step_s
        levels.append((at_s, raw))
    told = edges(levels)
    assert [event.time_s for event in told] == sorted(event.time_s for event in told)
    for button in (RIGHT, LEFT):
        mine = [event for event in told if event.button == button]
        assert [e.is_down for e in mine] == [i % 2 == 0 for i in range(len(mine))]
        # To the bit: an edge is held back by this very comparison.
        assert all(b.time_s >= a.time_s + HOLD_S for a, b in itertools.pairwise(mine))


@given(streams)
def test_levels_follow_the_edges_and_settle_at_the_raw_ones(stream: Levels) -> None:
    debouncer = Debouncer()
    at_s, down = 0.0, 0
    for step_s, raw in stream:
        at_s += step_s
        for event in debouncer.feed(at_s, raw):
            down ^= event.button
        assert debouncer.levels == down | (raw & ~3)
    last = stream[-1][1]
    debouncer.feed(at_s + HOLD_S, last)
    assert debouncer.levels == last


def test_the_first_edge_is_told_at_once() -> None:
    debouncer = Debouncer()
    assert debouncer.feed(5.0, 1) == (ButtonEvent(5.0, RIGHT, True),)


def test_both_pedals_in_one_packet_come_lowest_bit_first() -> None:
    debouncer = Debouncer()
    assert [e.button for e in debouncer.feed(0.0, 3)] == [RIGHT, LEFT]
    assert [e.is_down for e in debouncer.feed(1.0, 0)] == [False, False]


def test_a_pedal_pressed_while_the_stream_stands_still_is_told_afterwards() -> None:
    debouncer = Debouncer()
    debouncer.feed(0.0, 0)
    assert debouncer.feed(30.0, 2) == (ButtonEvent(30.0, LEFT, True),)


def test_a_suspect_packet_presses_nothing() -> None:
    debouncer = Debouncer()
    suspect = Pose(0.0, 0.0, np.eye(4), 3, PoseFlag.SUSPECT)
    assert debouncer.feed_pose(suspect) == ()
    assert debouncer.levels == 0
    assert len(debouncer.feed_pose(Pose(0.01, 0.01, np.eye(4), 1))) == 1


@pytest.mark.parametrize(
    ("times", "raw", "named"),
    [((1.0, 0.5), 0, "0.5"), ((1.0, float("nan")), 0, "nan"), ((0.0, 1.0), -1, "-1")],
)
def test_time_and_levels_that_cannot_be_are_refused(
    times: tuple[float, float], raw: int, named: str
) -> None:
    debouncer = Debouncer()
    debouncer.feed(times[0], 0)
    with pytest.raises(ValueError, match=named):
        debouncer.feed(times[1], raw)
    with pytest.raises(ValueError, match="hold_s"):
        Debouncer(hold_s=-0.1)


def _feed(pedals: list[int], flags: dict[int, PoseFlag] | None = None) -> list[int]:
    """Return the lengths of the presses in a row of pedals, 100 a second."""
    press = PressCollector(1)
    found = []
    for i, pedal in enumerate(pedals):
        flag = (flags or {}).get(i, PoseFlag.NONE)
        done = press.feed(Pose(0.01 * i, 0.01 * i, np.eye(4), pedal, flag))
        if done is not None:
            found.append(len(done))
    return found


def test_a_press_is_what_lies_between_the_edges() -> None:
    assert _feed([0] * 5 + [1] * 30 + [0] * 5) == [30]
    assert _feed(([0] * 5 + [1] * 20) * 3 + [0] * 5) == [20, 20, 20]


def test_chatter_belongs_to_the_press() -> None:
    assert _feed([1, 0, 1] + [1] * 20 + [0, 1, 0] + [0] * 5) == [23]


def test_a_short_press_is_chatter() -> None:
    assert _feed([0] * 5 + [1] * 5 + [0] * 20) == []


def test_other_pedals_do_not_matter() -> None:
    assert _feed([2] * 30 + [0] * 5) == []
    assert _feed([3] * 30 + [2] * 5) == [30]


def test_poses_that_may_be_wrong_are_left_out() -> None:
    flags = {10: PoseFlag.JUMP, 12: PoseFlag.SUSPECT}
    assert _feed([0] * 5 + [1] * 30 + [0] * 5, flags) == [28]
