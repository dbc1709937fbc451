"""A recording as a live device, by a clock that the test drives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.microscribe.emulator.in_memory import DrivenClock
from devices.pose import Pose, PoseFlag
from devices.pose_queue import LARGEST_QUEUE
from devices.recording.player import RecordedArm


def rotation(seed: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    frame = np.eye(4)
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    frame[:3, :3] = q * np.linalg.det(q)
    frame[:3, 3] = np.random.default_rng(seed).normal(size=3) * 50
    return frame


def recorded(times: list[float]) -> list[Pose]:
    return [
        Pose(t, 7.0, rotation(i), i % 4, PoseFlag(i % 3)) for i, t in enumerate(times)
    ]


rising = st.lists(st.floats(1e-4, 3.0), min_size=1, max_size=30).map(
    lambda steps: [float(t) for t in np.cumsum([0.3, *steps])]
)


@given(rising)
@settings(deadline=None)
def test_poses_come_back_bit_for_bit_at_exact_times(times: list[float]) -> None:
    clock = DrivenClock(1000.0)
    poses = recorded(times)
    arm = RecordedArm(poses, clock=clock)
    played = list(arm)
    assert len(played) == len(poses)
    for was, now in zip(poses, played, strict=True):
        assert now.device_from_tip.tobytes() == was.device_from_tip.tobytes()
        assert (now.time_s, now.buttons, now.flags) == (
            was.time_s,
            was.buttons,
            was.flags,
        )
        # The due moment is the closed form, to the bit: nothing has added up.
        assert now.host_time_s == 1000.0 + (was.time_s - times[0])


@given(rising, st.lists(st.floats(1e-3, 2.0), max_size=20))
@settings(deadline=None)
def test_no_pose_comes_early_and_none_is_late(
    times: list[float], waits: list[float]
) -> None:
    clock = DrivenClock(1000.0)
    arm = RecordedArm(recorded(times), clock=clock)
    for wait in waits:
        clock.sleep(wait)
        latest = arm.latest()
        due = [t for t in times if 1000.0 + (t - times[0]) <= clock.now()]
        assert latest is not None
        assert latest.time_s == due[-1]
        assert arm.pose_age_s() == clock.now() - latest.host_time_s


def test_reading_late_loses_nothing_and_keeps_due_times() -> None:
    clock = DrivenClock(1000.0)
    times = [0.0, 0.01, 0.02, 0.5]
    arm = RecordedArm(recorded(times), clock=clock)
    clock.sleep(0.1)
    assert [pose.host_time_s for pose in arm.drain()] == [1000.0, 1000.01, 1000.02]
    assert arm.drain() == []
    with pytest.raises(TimeoutError, match="recording"):
        arm.read(0.2)
    assert clock.now() == pytest.approx(1000.3)
    assert arm.read(1.0).host_time_s == 1000.5
    assert clock.now() == 1000.5
    with pytest.raises(EOFError, match="end"):
        arm.read(0.0)
    with pytest.raises(EOFError, match="end"):
        arm.drain()


def test_a_reader_that_is_minutes_behind_is_told() -> None:
    count = LARGEST_QUEUE + 10
    arm = RecordedArm(
        [Pose(i * 0.01, 0.0, np.eye(4), 0) for i in range(count)],
        clock=(clock := DrivenClock(1000.0)),
    )
    clock.sleep(1e4)
    with pytest.raises(Exception, match="10 poses were lost"):
        arm.read(0.0)
    assert arm.read(0.0).time_s == pytest.approx(0.1)


def test_a_closed_recording_gives_nothing_more() -> None:
    clock = DrivenClock(1000.0)
    with RecordedArm(recorded([0.0, 1.0]), clock=clock) as arm:
        assert arm.read(0.0).time_s == 0.0
    arm.close()
    clock.sleep(10.0)
    with pytest.raises(EOFError, match="closed"):
        arm.read(1.0)
    assert list(arm) == []


@pytest.mark.parametrize(
    ("times", "named"), [([0.0, 1.0, 1.0], "pose 2"), ([0.0, 2.0, 1.0, 3.0], "pose 2")]
)
def test_a_recording_that_does_not_run_forwards_is_refused(
    times: list[float], named: str
) -> None:
    with pytest.raises(ValueError, match=named):
        RecordedArm(recorded(times))


def test_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="no pose"):
        RecordedArm([])
