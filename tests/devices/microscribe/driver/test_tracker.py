import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.driver.tracker import SampleTracker
from devices.microscribe.kinematics.profiles import DX40937, HOME_COUNTS
from devices.microscribe.wire.packets import Packet
from devices.pose import PoseFlag

E = (16383, 5461, 7000, 4095, 3000, 8416)
F = (0, 5461, 7000, 0, 3000, 8416)


def _tracker() -> SampleTracker:
    return SampleTracker(DX40937.geometry, DX40937.encoders)


def _packet(counts: tuple[int, ...], timer: int, buttons: int = 0) -> Packet:
    return Packet(0x23, buttons, timer % 16384, counts)


def test_one_count_through_the_wrap_moves_the_tip_a_quarter_of_a_millimetre() -> None:
    tracker = _tracker()
    before = tracker.accept(_packet(E, 0), 0.0)
    after = tracker.accept(_packet(F, 9), 0.01)
    assert before is not None
    assert after is not None
    step = np.linalg.norm(after.tip_mm - before.tip_mm)
    assert step == pytest.approx(0.244, abs=5e-4)
    assert after.flags is PoseFlag.NONE
    assert tracker.counts[0] == 16384


@given(st.lists(st.integers(1, 16000), min_size=1, max_size=30), st.integers(0, 16383))
def test_time_is_the_sum_of_the_ticks(steps: list[int], start: int) -> None:
    tracker = _tracker()
    ticks, host = start, 5.0
    first = tracker.accept(_packet(HOME_COUNTS, ticks), host)
    assert first is not None
    for step in steps:
        ticks += step
        host += step / 900.0
        pose = tracker.accept(_packet(HOME_COUNTS, ticks), host)
        assert pose is not None
        assert pose.time_s == pytest.approx(ticks / 900.0)
        assert host - 1.0 / 900.0 <= pose.host_time_s <= host


def test_a_pause_longer_than_the_timer_is_counted_by_the_host() -> None:
    tracker = _tracker()
    tracker.accept(_packet(HOME_COUNTS, 100), 0.0)
    pose = tracker.accept(_packet(HOME_COUNTS, 100 + 36000), 40.003)
    assert pose is not None
    assert pose.time_s == pytest.approx(36100 / 900.0)


def test_a_flipped_high_bit_is_refused_and_counted() -> None:
    tracker = _tracker()
    tracker.accept(_packet(HOME_COUNTS, 0), 0.0)
    flipped = (HOME_COUNTS[0] ^ 8192, *HOME_COUNTS[1:])
    assert tracker.accept(_packet(flipped, 9), 0.01) is None
    good = tracker.accept(_packet(HOME_COUNTS, 18), 0.02)
    assert good is not None
    assert good.flags is PoseFlag.NONE
    assert tracker.refused == 1


def test_five_refusals_and_the_arm_is_believed() -> None:
    tracker = _tracker()
    tracker.accept(_packet(HOME_COUNTS, 0), 0.0)
    elsewhere = (HOME_COUNTS[0] - 4000, *HOME_COUNTS[1:])
    poses = [tracker.accept(_packet(elsewhere, 2 * i), 0.002 * i) for i in range(1, 7)]
    assert poses[:5] == [None] * 5
    assert poses[5] is not None
    assert poses[5].flags is PoseFlag.JUMP
    assert (tracker.refused, tracker.jumps) == (5, 1)


@given(st.integers(0, 4), st.floats(-700.0, 700.0))
def test_a_hands_speed_passes(joint: int, deg_s: float) -> None:
    tracker = _tracker()
    turn = DX40937.encoders.turn[joint]
    for i in range(20):
        counts = list(HOME_COUNTS)
        counts[joint] = (counts[joint] + round(deg_s * 0.01 * i * turn / 360)) % 16384
        assert tracker.accept(_packet(tuple(counts), 9 * i), 0.01 * i) is not None


@pytest.mark.parametrize(
    ("timer", "host_s", "lost"),
    [(9000 + 900, 11.0, False), (0, 11.0, True), (9900 + 300, 11.0, False)],
)
def test_a_timer_that_began_anew_tells_of_a_power_cut(
    timer: int, host_s: float, lost: bool
) -> None:
    tracker = _tracker()
    tracker.accept(_packet(HOME_COUNTS, 9000), 10.0)
    assert tracker.lost_power(_packet(HOME_COUNTS, timer), host_s) is lost


def test_a_pose_needs_timer_and_counts() -> None:
    with pytest.raises(ValueError, match="timer and six counts"):
        _tracker().accept(Packet(0x03, 0, None, HOME_COUNTS), 0.0)
