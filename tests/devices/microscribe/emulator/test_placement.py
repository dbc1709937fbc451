from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from devices.microscribe.emulator.placement import LARGEST_REACH_MM, place_arm
from devices.microscribe.kinematics.profiles import DX40937
from devices.pose import read_only_rigid
from devices.recording.probe_path import ProbePath


@settings(
    max_examples=5,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.integers(0, 1000))
def test_every_seed_finds_a_rigid_place_in_reach(
    short_path: ProbePath, seed: int
) -> None:
    place = place_arm(DX40937, short_path, short_path.tip_mm[:1], seed)
    read_only_rigid(place, "place")
    tips = short_path.tip_mm @ place[:3, :3].T + place[:3, 3]
    shoulder = (0.0, 0.0, DX40937.geometry.d_mm[0])
    assert np.linalg.norm(tips - shoulder, axis=1).max() <= LARGEST_REACH_MM
    # Posterior is down to within the largest tilt.
    assert (place[:3, :3] @ (0.0, 1.0, 0.0))[2] < -np.cos(np.radians(10.1))
    again = place_arm(DX40937, short_path, short_path.tip_mm[:1], seed)
    assert np.array_equal(place, again)


def test_a_path_longer_than_the_arm_is_refused(short_path: ProbePath) -> None:
    tip = short_path.tip_mm.copy()
    tip[:, 0] = np.linspace(0.0, 3000.0, len(tip))
    with pytest.raises(ValueError, match="no place for the arm"):
        place_arm(DX40937, replace(short_path, tip_mm=tip), tip[:0], 0)
