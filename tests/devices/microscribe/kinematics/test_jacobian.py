"""The closed Jacobians against central differences of the chain of joints."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.microscribe.kinematics.error_model import KinematicErrorModel
from devices.microscribe.kinematics.jacobian import (
    PARAMETER_NAMES,
    PARAMETERS,
    joint_jacobian,
    parameter_jacobian,
)
from devices.microscribe.kinematics.profiles import DX40937, SECOND_3DX

GEOMETRY = SECOND_3DX.geometry


def _angles(seed: int) -> NDArray[np.float64]:
    return np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 6)


def _change(
    ahead: NDArray[np.float64], behind: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the shift and the small rotation vector from one frame to another."""
    turn = ahead[:3, :3] @ behind[:3, :3].T
    vector = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], 0.0])
    vector[2] = turn[1, 0] - turn[0, 1]
    return np.concatenate((ahead[:3, 3] - behind[:3, 3], vector / 2.0))


def _difference(angles: NDArray[np.float64], i: int, step: float) -> np.ndarray:
    delta = np.zeros(PARAMETERS)
    delta[i] = step
    ahead = KinematicErrorModel.deviating(GEOMETRY, delta).device_from_tip(angles)
    behind = KinematicErrorModel.deviating(GEOMETRY, -delta).device_from_tip(angles)
    return _change(ahead, behind) / (2.0 * step)


seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=20)
@given(seeds)
def test_every_parameter_moves_the_tip_as_differences_say(seed: int) -> None:
    angles = _angles(seed)
    closed = parameter_jacobian(GEOMETRY, angles)
    for i in range(PARAMETERS):
        numeric = _difference(angles, i, 1e-5)
        np.testing.assert_allclose(
            closed[:, i], numeric, atol=1e-6, err_msg=PARAMETER_NAMES[i]
        )


@pytest.mark.parametrize("name", ["alpha 2", "zero 1", "zero 3", "beta"])
def test_differences_converge_at_second_order(name: str) -> None:
    angles = _angles(7)
    i = PARAMETER_NAMES.index(name)
    closed = parameter_jacobian(GEOMETRY, angles)[:, i]
    errors = [
        float(np.linalg.norm(_difference(angles, i, step) - closed))
        for step in (4e-2, 2e-2, 1e-2)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.02)


@given(seeds)
def test_joints_are_the_zeros_among_the_parameters(seed: int) -> None:
    angles = _angles(seed)
    joints = joint_jacobian(GEOMETRY, angles)
    columns = [i for i, n in enumerate(PARAMETER_NAMES) if n.startswith("zero")]
    np.testing.assert_array_equal(
        parameter_jacobian(GEOMETRY, angles)[:, columns], joints
    )


def test_batches_agree_with_single_poses() -> None:
    batch = np.stack([_angles(1), _angles(2)])
    both = parameter_jacobian(GEOMETRY, batch)
    for i in range(2):
        np.testing.assert_allclose(
            both[i], parameter_jacobian(GEOMETRY, batch[i]), atol=1e-12
        )


def test_one_count_at_the_rest_pose_moves_the_tip_by_known_amounts() -> None:
    # Worked out in float64 for this arm's constants at its recorded rest pose.
    counts = np.array(DX40937.home_counts)
    encoders = DX40937.encoders
    jacobian = joint_jacobian(DX40937.geometry, encoders.angles(counts))[:, :5]
    step = 2.0 * np.pi / np.array(encoders.turn[:5])
    moved = np.linalg.norm(jacobian[:3] * step, axis=0)
    np.testing.assert_allclose(moved, (0.029, 0.019, 0.228, 0.215, 0.206), atol=6e-4)
    axis = DX40937.geometry.device_from_tip(encoders.angles(counts))[:3, 2]
    tilt = np.linalg.norm(np.cross(jacobian[3:].T, axis), axis=1) * step
    np.testing.assert_allclose(
        np.degrees(tilt), (0.0002, 0.022, 0.044, 0.086, 0.088), atol=6e-4
    )
