"""How still a tip is, and how fast poses come."""

import numpy as np
import pytest

from devices import Pose
from paravol.registration.arm_watch import ArmReading, ArmWatch

COUNTS = 1, 2, 3, 4, 5, 0


def readings(sigma_mm: float, speed_mm_s: float, hz: float, count: int) -> ArmReading:
    rng = np.random.default_rng(3)
    watch = ArmWatch()
    for n in range(count):
        frame = np.eye(4)
        frame[:3, 3] = rng.normal(0.0, sigma_mm, 3) if sigma_mm else 0.0
        frame[0, 3] += speed_mm_s * n / hz
        last = watch.feed(Pose.of_rigid(n / hz, n / hz, frame, 2), COUNTS)
    return last


@pytest.mark.parametrize("hz", [20.0, 100.0, 300.0])
def test_rate_and_noise_are_those_that_were_put_in(hz: float) -> None:
    found = readings(0.05, 0.0, hz, 900)
    assert found.rate_hz == pytest.approx(hz)
    # of three coordinates; the mean takes one of n degrees of freedom
    assert found.noise_mm == pytest.approx(0.05 * 3**0.5, rel=0.25)
    assert (found.counts, found.pedals) == (COUNTS, ("left",))


def test_a_moving_tip_has_no_noise_and_few_poses_say_nothing() -> None:
    assert readings(0.0, 10.0, 100.0, 300).noise_mm is None
    few = readings(0.05, 0.0, 100.0, 3)
    assert (few.rate_hz, few.noise_mm) == (None, None)
    assert readings(0.0, 0.0, 100.0, 300).noise_mm == 0.0
