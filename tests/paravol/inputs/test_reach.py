"""What no hand can have sent is a gap, whatever a tracker calls a tool it misses."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices import DeviceError, DeviceReason, Pose
from paravol.inputs.pose_sources import EndedError, ReconnectingSource
from paravol.inputs.reach import AWAY_S, REACH_MM, Reach, ReachedPoses
from paravol.inputs.second_device import SecondDevice
from renderers.scene import Volume

MISSING = (-3.697e28, 1e6, -math.inf, math.nan, 2.01 * REACH_MM)
"""What comes for a tool that is not there, as x, mm."""

PERIOD_S = 0.0625


def pose(number: int, x_mm: float) -> Pose:
    """Return a pose that a driver made without a look at it."""
    frame = np.eye(4)
    frame[0, 3] = x_mm
    time_s = PERIOD_S * number
    return Pose.of_rigid(time_s, time_s, frame, 0)


def around_head() -> Reach:
    """Return the reach of a head that lies aside, of a device that is turned."""
    head = Volume(
        np.zeros((5, 5, 5), np.float32),
        np.full(3, 50.0),
        np.array([900.0, -100.0, -100.0]),
    )
    turned = np.diag([-1.0, -1.0, 1.0, 1.0])
    turned[0, 3] = 1000.0
    return Reach.of(head, turned)


class Sent:
    """Poses that are there, then silence."""

    def __init__(self, poses: list[Pose], then: type[Exception] = TimeoutError) -> None:
        self.poses, self.then = poses, then

    def read(self, timeout_s: float) -> Pose:
        if not self.poses:
            raise self.then
        return self.poses.pop(0)

    def drain(self) -> list[Pose]:
        poses, self.poses = self.poses, []
        return poses


def test_the_reach_is_counted_from_the_heads_middle() -> None:
    """Its middle lies at 1000 mm, which is the device's origin."""
    reach = around_head()
    assert reach.middle_mm == pytest.approx((0.0, 0.0, 0.0))
    assert reach.holds(pose(0, 0.99 * REACH_MM))
    assert reach.holds(pose(0, -0.99 * REACH_MM))
    assert (reach.left_out, reach.told()) == (0, "")
    for x_mm in MISSING:
        assert not reach.holds(pose(0, x_mm))
    assert reach.left_out == len(MISSING)
    assert reach.told().startswith(f"{len(MISSING)} poses ")


@given(st.lists(st.sampled_from([0.0, *MISSING]), min_size=1, max_size=40))
def test_all_in_reach_pass_in_order_and_each_long_gap_is_told_once(
    places: list[float],
) -> None:
    sent = [pose(n, x_mm) for n, x_mm in enumerate(places)]
    known = [n for n, x_mm in enumerate(places) if x_mm == 0.0]
    losses: list[DeviceError] = []
    back: list[float] = []
    reached = ReachedPoses(Sent(list(sent)), around_head())
    source = ReconnectingSource(
        reached, patience_s=0.0, on_loss=losses.append, on_return=back.append
    )
    got = []
    try:
        while True:
            got.append(source.read(0.0))
    except TimeoutError:
        pass
    assert got == [sent[n] for n in known]
    assert reached.reach is not None
    assert reached.reach.left_out == len(places) - len(known)
    # a gap counts from the pose before it, where there was one
    ends = [*known, len(places)]
    gaps = [n - m - 1 for m, n in zip([-1, *known], ends, strict=False)]
    long = [gap > AWAY_S / PERIOD_S for gap in gaps]
    long[0] = gaps[0] > 0
    assert len(losses) == sum(long)
    assert {loss.reason for loss in losses} <= {DeviceReason.OUT_OF_REACH}
    assert len(back) == sum(long[:-1])


def test_the_end_of_a_recording_is_the_end_of_the_flight() -> None:
    """Its last pose may be one that is left out."""
    reached = ReachedPoses(Sent([pose(0, 0.0), pose(1, 1e6)], EOFError), around_head())
    reached.read(0.0)
    with pytest.raises(EndedError):
        reached.read(0.0)


def test_poses_pass_until_it_is_known_where_they_lie() -> None:
    far = pose(0, 1e6)
    assert ReachedPoses(Sent([far])).read(0.0) is far


def test_a_second_device_out_of_reach_is_away() -> None:
    sent = [pose(n, x_mm) for n, x_mm in enumerate((0.0, 1e6, 1e6, 0.0))]
    second = SecondDevice(Sent(list(sent)), "tracker")
    second.reach = around_head()
    found = [second.at(PERIOD_S * n) for n in range(4)]
    assert found == [sent[0], sent[0], sent[0], sent[3]]
    assert second.reach.left_out == 2
