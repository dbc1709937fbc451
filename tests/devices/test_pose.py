import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.pose import Pose


def _pose(matrix: np.ndarray) -> Pose:
    return Pose(time_s=0.0, host_time_s=1.0, device_from_tip=matrix, buttons=0)


def test_pose_points_away_from_the_hand_and_cannot_be_changed() -> None:
    matrix = np.eye(4)
    matrix[:3, 3] = 1.0, 2.0, 3.0
    pose = _pose(matrix)
    matrix[0, 3] = 99.0
    assert pose.tip_mm.tolist() == [1.0, 2.0, 3.0]
    assert pose.pointing.tolist() == [0.0, 0.0, -1.0]
    with pytest.raises(ValueError, match="read-only"):
        pose.device_from_tip[0, 3] = 5.0


@pytest.mark.parametrize(
    "matrix",
    [
        np.eye(3),
        np.full((4, 4), np.nan),
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.diag([1.001, 1.0, 1.0, 1.0]),
        np.diag([1.0, 1.0, 1.0, 2.0]),
    ],
)
def test_pose_refuses_what_is_not_rigid(matrix: np.ndarray) -> None:
    with pytest.raises(ValueError, match="device_from_tip must"):
        _pose(matrix)


def test_pose_refuses_endless_times_and_negative_buttons() -> None:
    with pytest.raises(ValueError, match="times must be finite"):
        Pose(float("nan"), 0.0, np.eye(4), 0)
    with pytest.raises(ValueError, match="buttons"):
        Pose(0.0, 0.0, np.eye(4), -1)


def test_a_pose_of_rotations_needs_no_check_and_is_as_fixed() -> None:
    checked, trusted = _pose(np.eye(4)), Pose.of_rigid(0.0, 1.0, np.eye(4), 0)
    assert (checked.device_from_tip == trusted.device_from_tip).all()
    for key in ("time_s", "host_time_s", "buttons", "flags"):
        assert getattr(checked, key) == getattr(trusted, key)
    with pytest.raises(ValueError, match="read-only"):
        trusted.device_from_tip[0, 3] = 5.0


@given(st.integers(0, 11), st.floats(-1e-3, 1e-3))
def test_the_check_is_that_of_the_matrix_itself(at: int, off: float) -> None:
    matrix = np.eye(4)
    matrix.flat[at] += off
    turn = matrix[:3, :3]
    drift = np.abs(turn @ turn.T - np.eye(3)).max()
    if drift > 2e-6:
        with pytest.raises(ValueError, match="must be a rotation"):
            _pose(matrix)
    elif drift < 5e-7:
        _pose(matrix)
