from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import TipChange
from devices.microscribe.kinematics.arm_errors import ArmErrors
from devices.microscribe.kinematics.error_model import KinematicErrorModel
from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.kinematics.uncertainty import ParameterSpread

TIP = np.array([0.0, 0.0, -14.0])
HOME = DX40937.encoders.angles(np.array(DX40937.home_counts))
HOME[5] = 0.0
SPREAD = ParameterSpread()


def _errors(tip_sigma: float = 0.0) -> ArmErrors:
    covariance = np.diag([0.0, 0.0, tip_sigma**2])
    return ArmErrors(DX40937.geometry, DX40937.encoders, SPREAD, TIP, covariance)


def _angles(count: int) -> NDArray[np.float64]:
    swing = np.random.default_rng(1).uniform(-0.2, 0.2, (count, 6))
    swing[:, 5] = 0.0
    return HOME + swing


def _frames(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    longer = DX40937.geometry.with_tip(TipChange(14.0))
    return longer.device_from_tip(angles)


def test_the_angles_of_a_frame_are_found_again() -> None:
    angles = _angles(5)
    np.testing.assert_allclose(_errors().angles(_frames(angles)), angles, atol=1e-7)
    assert _errors().angles(np.zeros((0, 4, 4))).shape == (0, 6)


def test_an_elbow_and_a_wrist_stay_on_their_side() -> None:
    """An arm that is held the other way round has the same poses by other angles."""
    flipped = HOME + np.array([0.0, 0.0, 0.0, np.pi, 0.0, 0.0])
    flipped[4] = -HOME[4]
    angles = flipped + (_angles(6) - HOME)
    frames = _frames(angles)
    held = replace(_errors(), near=flipped).held_as(frames[0])
    np.testing.assert_allclose(held.angles(frames), angles, atol=1e-7)
    for frame, one in zip(frames[::-1], angles[::-1], strict=True):
        np.testing.assert_allclose(held.angles(frame[None])[0], one, atol=1e-7)
    from_rest = _errors().angles(frames)
    assert np.abs(from_rest - angles).max() > 1.0
    np.testing.assert_allclose(
        DX40937.geometry.with_tip(TipChange(14.0)).device_from_tip(from_rest)[:, :3, 3],
        frames[:, :3, 3],
        atol=1e-6,
    )


def test_points_move_as_the_constants_say() -> None:
    angles = _angles(4)
    frames = _frames(angles)
    turn = np.eye(4)
    turn[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    found = _errors().at(frames, turn, np.zeros((4, 3, 3)))
    longer = DX40937.geometry.with_tip(TipChange(14.0))
    deviation = 0.1 * SPREAD.draw(np.random.default_rng(6))
    built = KinematicErrorModel.deviating(longer, deviation).device_from_tip(angles)
    moved = (built - frames)[:, :3, 3] @ turn[:3, :3].T
    units = np.append(deviation / SPREAD.deviations(), np.zeros(3))
    np.testing.assert_allclose(found.common @ units, moved, atol=2e-5)
    assert np.linalg.norm(moved, axis=1).min() > 1e-3


def test_an_unsure_tip_is_one_more_shared_cause() -> None:
    frames = _frames(_angles(3))
    none = np.zeros((3, 3, 3))
    sure = _errors().at(frames, np.eye(4), none)
    unsure = _errors(0.3).at(frames, np.eye(4), none)
    assert sure.common.shape == unsure.common.shape == (3, 3, 28)
    added = unsure.common[:, :, 25:]
    lengths = np.linalg.norm(added, axis=(1, 2))
    np.testing.assert_allclose(lengths, 0.3, atol=1e-12)
    along = added @ np.swapaxes(added, 1, 2)
    axis = frames[:, :3, 2]
    wanted = 0.09 * axis[:, :, None] * axis[:, None, :]
    np.testing.assert_allclose(along, wanted, atol=1e-12)


def test_own_noise_adds_to_the_rounding() -> None:
    frames = _frames(_angles(2))
    bare = _errors().at(frames, np.eye(4), np.zeros((2, 3, 3)))
    shaken = _errors().at(frames, np.eye(4), np.tile(np.eye(3) * 0.04, (2, 1, 1)))
    rms = np.sqrt(np.trace(bare.noise, axis1=1, axis2=2))
    assert rms == pytest.approx(0.1, abs=0.05)
    np.testing.assert_allclose(
        shaken.noise - bare.noise, np.tile(np.eye(3) * 0.04, (2, 1, 1)), atol=1e-12
    )
