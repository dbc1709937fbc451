import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.kinematics.forward import ForwardKinematics
from devices.microscribe.kinematics.profiles import PROFILES, ArmProfile

_counts = st.lists(st.integers(-200_000, 200_000), min_size=6, max_size=6)


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
@given(counts=_counts)
def test_one_pose_is_what_whole_arrays_give(
    profile: ArmProfile, counts: list[int]
) -> None:
    forward = ForwardKinematics(profile.geometry, profile.encoders)
    unwrapped = np.array(counts)
    expected = profile.geometry.device_from_tip(profile.encoders.angles(unwrapped))
    assert np.abs(forward.device_from_tip(unwrapped) - expected).max() < 1e-9


@given(_counts)
def test_the_frame_stays_a_rotation(counts: list[int]) -> None:
    profile = PROFILES["3dx_b"]
    forward = ForwardKinematics(profile.geometry, profile.encoders)
    frame = forward.device_from_tip(np.array(counts))
    turn = frame[:3, :3]
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 1e-13
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert frame[3].tolist() == [0.0, 0.0, 0.0, 1.0]


def test_six_counts_are_needed() -> None:
    profile = PROFILES["dx40937"]
    forward = ForwardKinematics(profile.geometry, profile.encoders)
    with pytest.raises(ValueError, match="6 counts"):
        forward.device_from_tip(np.array((1, 2)))
