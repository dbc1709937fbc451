from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from scenarios.metrics import Settings, Track
from scenarios.metrics.track import low_pass, second_column, third_column, turns_deg
from system import UserError
from tests.scenarios.metrics.tracks import joined, swaying, track, wander


def test_samples_that_are_no_pose_are_dropped() -> None:
    times, tips = wander(1.0)
    tips[10], tips[20, 1] = np.nan, np.inf
    times[30] = np.nan
    frames = track(times, tips)
    assert len(frames.valid) == len(times) - 3


@pytest.mark.parametrize("word", [1e6, -3.697e28, -np.inf, np.nan])
def test_a_trackers_word_for_a_tool_that_it_misses_is_no_place(word: float) -> None:
    times, tips = wander(1.0)
    tips[5, 1] = word
    seen = track(times, tips)
    assert seen.valid.tolist() == [n for n in range(len(times)) if n != 5]


def test_a_clock_that_stops_or_runs_back_gives_no_samples() -> None:
    tips = np.zeros((6, 3))
    frames = track([0.0, 1.0, 1.0, 0.5, 1.5, 2.0], tips)
    assert frames.valid.tolist() == [0, 1, 4, 5]


def test_a_gap_and_another_tool_split() -> None:
    times, tips = wander(1.0)
    late = np.where(np.arange(len(times)) >= 40, times + 1.0, times)
    old = track(late, tips)
    part = (np.arange(len(times)) >= 70).astype(np.int64)
    split = Track(old.time_s, old.tip_mm, old.quaternion, part)
    assert [len(places) for places in split.spans(0.5)] == [40, 30, 31]


def test_a_frame_that_is_no_rotation_is_no_pose() -> None:
    frames = np.tile(np.eye(4), (3, 1, 1))
    frames[1, :3, :3] *= 2.0
    assert Track.of_frames(np.arange(3.0), frames).valid.tolist() == [0, 2]


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(UserError, match="tip_mm of 2 samples"):
        Track(np.zeros(2), np.zeros((3, 3)), np.zeros((2, 4)), np.zeros(2, np.int64))


@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 250.0, 1000.0])
def test_pieces_are_alike_at_any_rate(rate_hz: float) -> None:
    times, tips = wander(4.0, rate_hz)
    (piece,) = track(times, tips).pieces(Settings())
    _, true = wander(4.0)
    assert piece.rate_hz == 100.0
    inside = slice(50, -50)
    assert np.abs(piece.tip_mm[inside] - true[inside]).max() < 0.01


def test_the_filter_has_no_delay_and_its_stated_cutoff() -> None:
    t = np.arange(0.0, 20.0, 0.01)
    for hertz, gain in ((0.5, 1.0), (6.0, 0.5), (30.0, 0.0)):
        wave = np.sin(2 * np.pi * hertz * t)[:, None]
        passed = low_pass(wave, 100.0, Settings())[500:1500]
        assert passed == pytest.approx(gain * wave[500:1500], abs=0.003)


def test_signs_of_quaternions_do_not_count() -> None:
    times, tips = wander(2.0)
    old = track(times, tips, swaying(times))
    flip = np.where(np.arange(len(times)) % 3 == 0, -1.0, 1.0)[:, None]
    new = Track(old.time_s, old.tip_mm, flip * old.quaternion, old.part)
    (a,), (b,) = old.pieces(Settings()), new.pieces(Settings())
    turned = turns_deg(a.quaternion)
    assert turns_deg(b.quaternion) == pytest.approx(turned, abs=1e-9)
    assert a.back == pytest.approx(b.back, abs=1e-12)


@given(st.lists(st.floats(-np.pi, np.pi), min_size=3, max_size=3))
def test_columns_are_those_of_the_matrix(angles: list[float]) -> None:
    turn = Rotation.from_euler("zyx", angles)
    quaternion = turn.as_quat()[None]
    assert second_column(quaternion)[0] == pytest.approx(turn.as_matrix()[:, 1])
    assert third_column(quaternion)[0] == pytest.approx(turn.as_matrix()[:, 2])


@given(st.floats(1e-9, np.pi - 1e-9))
def test_small_and_large_turns_are_exact(angle: float) -> None:
    pair = Rotation.from_rotvec([[0, 0, 0], [0, 0, angle]]).as_quat()
    assert turns_deg(pair)[0] == pytest.approx(np.degrees(angle), rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, 120), max_size=5))
def test_chunks_join_to_the_same_bits(cuts: list[int]) -> None:
    times, tips = wander(1.2)
    whole = track(times, tips, swaying(times))
    edges = [0, *sorted(cuts), len(times)]
    chunks = [
        track(times[a:b], tips[a:b], swaying(times)[a:b]) for a, b in pairwise(edges)
    ]
    again = joined(chunks)
    for name in ("time_s", "tip_mm", "quaternion", "part"):
        assert np.array_equal(getattr(again, name), getattr(whole, name))
