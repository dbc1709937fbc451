import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from devices.microscribe.kinematics.inverse import InverseKinematics, UnreachableError
from devices.microscribe.kinematics.profiles import DX40937

INVERSE = InverseKinematics(DX40937.geometry)
HOME = np.array(DX40937.home_counts) * (2.0 * np.pi / np.array(DX40937.encoders.turn))
HOME[5] = 0.0


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
@example(905)  # nine starts, scattered anywhere, did not find it
@example(629)
@example(3526)  # all but singular
def test_a_pose_is_found_again_from_the_rest_pose(seed: int) -> None:
    angles = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 6)
    angles[5] = 0.0
    wanted = DX40937.geometry.device_from_tip(angles)
    found = INVERSE.solve_afresh(wanted[:3, 3], -wanted[:3, 2], HOME)
    got = DX40937.geometry.device_from_tip(found)
    np.testing.assert_allclose(got[:3, 3], wanted[:3, 3], atol=1e-6)
    np.testing.assert_allclose(got[:3, 2], wanted[:3, 2], atol=1e-8)
    assert found[5] == 0.0


def test_a_followed_motion_stays_on_its_branch() -> None:
    at = HOME
    for i in range(200):
        swing = np.array([0.5, 0.3, 0.2, 0.4, 0.5, 0.0]) * np.sin(i / 100.0)
        wanted = DX40937.geometry.device_from_tip(HOME + swing)
        at = INVERSE.solve(wanted[:3, 3], -wanted[:3, 2], at)
        np.testing.assert_allclose(at, HOME + swing, atol=1e-7)


def test_forearm_stays_still_where_it_has_no_influence() -> None:
    # Stylus nearly in line with the forearm: turning joint 3 moves next to nothing.
    lined = HOME.copy()
    lined[4] = 1e-9
    target = DX40937.geometry.device_from_tip(lined)
    tip, pointing = target[:3, 3], -target[:3, 2]
    shifted = tip + np.array([0.0, 0.0, 0.01])
    found = INVERSE.solve(shifted, pointing, lined)
    assert abs(found[3] - lined[3]) < 0.2


def test_out_of_reach_is_said() -> None:
    with pytest.raises(UnreachableError, match="cannot reach"):
        INVERSE.solve(np.array([900.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0]), HOME)
