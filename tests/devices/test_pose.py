import numpy as np
import pytest

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
