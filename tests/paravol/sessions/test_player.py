"""Playback keeps exact time, however late its frames are."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paravol.sessions.player import FASTEST, SLOWEST, Player
from system import UserError


class FakeClock:
    """Time passes only as it is told to."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now(self) -> float:
        return self.time_s

    def sleep(self, seconds: float) -> None:
        assert seconds >= 0.0
        self.time_s += seconds


TEN_MINUTES = [i / 100 for i in range(60_001)]


@settings(max_examples=25, deadline=None)
@given(
    began_s=st.floats(-1e6, 1e6),
    speed=st.floats(SLOWEST, FASTEST),
    fps=st.sampled_from([0.5, 1.0, 24.0, 30.0, 59.94]),
    late=st.lists(st.floats(0.0, 0.9), min_size=1, max_size=20),
    drawn=st.lists(st.floats(0.0, 3.0), min_size=1, max_size=20),
)
def test_ten_minutes_end_within_a_frame(
    began_s: float, speed: float, fps: float, late: list[float], drawn: list[float]
) -> None:
    """Sleeps that end late and frames that take long leave frames out, add no drift.

    late, drawn: in frames; by how much a sleep is late, and how long drawing takes.
    """
    clock = FakeClock()
    clock.time_s = began_s
    player = Player(TEN_MINUTES, clock, speed=speed)
    player.play()
    frame_s = 1.0 / fps
    count = 0
    while not player.is_over:
        shown_s = player.position_s
        assert abs(shown_s - speed * (clock.now() - began_s)) < 1e-6
        clock.time_s += drawn[count % len(drawn)] * frame_s
        before = clock.now()
        clock.sleep(player.next_frame_s(fps))
        due = (clock.now() - began_s) * fps
        # at a whole frame, the next one
        assert abs(due - round(due)) < 1e-3
        assert clock.now() - before <= frame_s * (1 + 1e-4)
        clock.time_s += late[count % len(late)] * frame_s
        count += 1
    lasted_s = clock.now() - began_s
    # over at the first look after the end, and looked at every 0.9 + 3 + 1 frames
    assert 600.0 / speed - 1e-6 <= lasted_s
    slowest = (1 + max(late) + max(drawn)) * frame_s
    assert lasted_s < 600.0 / speed + slowest + 1e-6
    assert player.position_s == 600.0


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0, 2.0, 10.0])
def test_a_prompt_clock_shows_every_frame(speed: float) -> None:
    clock = FakeClock()
    player = Player(TEN_MINUTES, clock, speed=speed)
    player.play()
    count = 1
    while not player.is_over:
        clock.sleep(player.next_frame_s(30.0))
        count += 1
        if count % 997 == 0:
            # less than a frame off, and nowhere near it
            assert abs(player.position_s - speed * (count - 1) / 30.0) < 1e-6
    assert abs(count - (600.0 / speed * 30.0 + 1)) <= 1


ACTIONS = st.one_of(
    st.tuples(st.just("wait"), st.floats(0.0, 30.0)),
    st.tuples(st.just("pause"), st.just(0.0)),
    st.tuples(st.just("play"), st.just(0.0)),
    st.tuples(st.just("speed"), st.floats(SLOWEST, FASTEST)),
    st.tuples(st.just("seek"), st.floats(-10.0, 700.0)),
)


@settings(max_examples=60, deadline=None)
@given(actions=st.lists(ACTIONS, max_size=30))
def test_whatever_is_done_time_adds_up(actions: list[tuple[str, float]]) -> None:
    """The position is what a sum over all that was done gives."""
    clock = FakeClock()
    player = Player(TEN_MINUTES, clock)
    expected, speed, is_playing = 0.0, 1.0, False
    for name, value in actions:
        if name == "wait":
            clock.sleep(value)
            expected += speed * value if is_playing else 0.0
        elif name == "speed":
            player.speed = speed = value
        elif name == "seek":
            player.seek(value)
            expected = value
        else:
            is_playing = name == "play"
            player.play() if is_playing else player.pause()
        expected = min(max(expected, 0.0), 600.0)
        assert math.isclose(player.position_s, expected, abs_tol=1e-6)
        assert player.is_playing == is_playing


@given(
    times=st.lists(st.floats(0.0, 100.0), min_size=1, max_size=30),
    steps=st.lists(st.integers(-5, 5), max_size=10),
)
def test_steps_stand_at_samples(times: list[float], steps: list[int]) -> None:
    """Also where the recording's clock ran backwards; the place never leaves it."""
    player = Player(times, FakeClock())
    assert player.times_s == sorted(player.times_s)
    for step in steps:
        before = player.place
        player.step(step)
        assert player.position_s == player.times_s[player.place]
        wanted = min(max(before + step, 0), len(times) - 1)
        # of several samples at one time the last is shown
        assert player.times_s[player.place] == player.times_s[wanted]


def test_a_loop_goes_round_without_drift() -> None:
    clock = FakeClock()
    player = Player(TEN_MINUTES, clock, speed=2.0, loop_s=(10.0, 14.0))
    player.seek(10.0)
    player.play()
    for i in range(10_000):
        clock.time_s = i * 0.37
        expected = 10.0 + (2.0 * clock.time_s) % 4.0
        away = abs(player.position_s - expected)
        assert min(away, 4.0 - away) < 1e-6
        assert not player.is_over


@pytest.mark.parametrize("speed", [0.0, 0.09, 11.0, -1.0, math.nan])
def test_speeds_that_cannot_be_played_are_refused(speed: float) -> None:
    with pytest.raises(UserError, match=r"0\.1 to 10 times"):
        Player([0.0, 1.0], FakeClock(), speed=speed)


def test_nothing_cannot_be_played() -> None:
    with pytest.raises(UserError, match="no sample"):
        Player([], FakeClock())
    with pytest.raises(UserError, match="go round"):
        Player([0.0, 1.0], FakeClock(), loop_s=(2.0, 1.0))
    with pytest.raises(UserError, match="no time"):
        Player([0.0, 1.0], FakeClock()).seek(math.nan)
