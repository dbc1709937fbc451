"""Propagated covariances against what random rounding and random constants do."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import Encoders
from devices.microscribe.kinematics.error_model import KinematicErrorModel
from devices.microscribe.kinematics.jacobian import joint_jacobian
from devices.microscribe.kinematics.profiles import (
    DX40937,
    NOMINAL,
    SECOND_3DX,
    ArmProfile,
)
from devices.microscribe.kinematics.uncertainty import ArmUncertainty, ParameterSpread

GEOMETRY = DX40937.geometry


def covariance_of(
    arm: ArmUncertainty, angles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the covariance (..., 6, 6) of one pose; mm and radians."""
    common = arm.common_factor(angles)
    shared: NDArray[np.float64] = common @ np.swapaxes(common, -1, -2)
    return arm.quantisation(angles) + shared


def largest_rounding_mm(
    arm: ArmUncertainty, angles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return a bound (...) of the tip's error by rounding, to first order."""
    columns = joint_jacobian(arm.geometry, angles)[..., :3, :]
    reach = np.linalg.norm(columns, axis=-2)
    bound: NDArray[np.float64] = (reach * arm.steps() / 2.0).sum(axis=-1)
    return bound


def tip_rms_mm(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rms length (...) of the tip's error from covariances (..., 6, 6)."""
    return np.asarray(np.sqrt(np.trace(covariance[..., :3, :3], axis1=-2, axis2=-1)))


def axis_rms_rad(
    covariance: NDArray[np.float64], device_from_tip: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the rms angle (...) by which the stylus' axis is off.

    Turning about the axis itself does not move it and does not count.
    """
    turn, axis = covariance[..., 3:, 3:], device_from_tip[..., :3, 2]
    along = np.einsum("...i,...ij,...j->...", axis, turn, axis)
    across = np.trace(turn, axis1=-2, axis2=-1) - along
    return np.asarray(np.sqrt(np.maximum(across, 0.0)))


def _angles(count: int, seed: int = 0) -> NDArray[np.float64]:
    angles = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, (count, 6))
    angles[:, 5] = 0.0
    return angles


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("turn", [4000, 8192, 16384, 65536])
def test_rounding_is_what_the_formula_says(turn: int) -> None:
    angles = _angles(3000)
    arm = ArmUncertainty(GEOMETRY, Encoders((turn,) * 5 + (1,)))
    encoders = arm.encoders
    rounded = GEOMETRY.device_from_tip(encoders.angles(encoders.counts(angles)))
    exact = GEOMETRY.device_from_tip(angles)
    tip = np.linalg.norm((rounded - exact)[:, :3, 3], axis=1)
    axis = np.linalg.norm((rounded - exact)[:, :3, 2], axis=1)
    covariance = arm.quantisation(angles)
    assert _rms(tip) == pytest.approx(_rms(tip_rms_mm(covariance)), rel=0.05)
    assert _rms(axis) == pytest.approx(_rms(axis_rms_rad(covariance, exact)), rel=0.05)
    assert (tip <= largest_rounding_mm(arm, angles) * 1.01).all()
    # The errors of this arm, 656 mm long, in mm and degrees at 4096 counts.
    assert _rms(tip) * turn / 4096 == pytest.approx(0.245, rel=0.05)
    assert np.degrees(_rms(axis)) * turn / 4096 == pytest.approx(0.048, rel=0.05)


def test_the_built_in_encoders_round_to_a_tenth_of_a_millimetre() -> None:
    angles = _angles(20000)
    arm = ArmUncertainty(GEOMETRY, DX40937.encoders)
    covariance = arm.quantisation(angles)
    assert _rms(tip_rms_mm(covariance)) == pytest.approx(0.106, abs=0.002)
    tilt = axis_rms_rad(covariance, GEOMETRY.device_from_tip(angles))
    assert np.degrees(_rms(tilt)) == pytest.approx(0.035, abs=0.002)


# rms tip error over the workspace for one kind of constant, mm.
SENSITIVITY = [
    (ParameterSpread(0.1, 0.0, 0.0), 0.35),
    (ParameterSpread(0.0, math.radians(0.05), 0.0), 0.55),
    (ParameterSpread(0.0, 0.0, math.radians(0.05)), 0.48),
    (ParameterSpread(), 0.245),
]


@pytest.mark.parametrize(("spread", "expected"), SENSITIVITY)
def test_constants_cost_what_was_propagated(
    spread: ParameterSpread, expected: float
) -> None:
    angles = _angles(400)
    arm = ArmUncertainty(GEOMETRY, Encoders((1,) * 6), spread)
    propagated = _rms(tip_rms_mm(covariance_of(arm, angles)))
    assert propagated == pytest.approx(expected, rel=0.06)
    rng = np.random.default_rng(3)
    exact = GEOMETRY.device_from_tip(angles)[:, :3, 3]
    drawn = []
    for _ in range(300):
        built = KinematicErrorModel.deviating(GEOMETRY, spread.draw(rng))
        tips = built.device_from_tip(angles)[:, :3, 3]
        drawn.append(_rms(np.linalg.norm(tips - exact, axis=1)))
    assert _rms(np.array(drawn)) == pytest.approx(propagated, rel=0.1)


@pytest.mark.parametrize("profile", [DX40937, SECOND_3DX, NOMINAL])
def test_the_block_s_words_are_fine_enough(profile: ArmProfile) -> None:
    words = ParameterSpread(0.0254 / math.sqrt(12), math.pi / 32768 / math.sqrt(12), 0)
    arm = ArmUncertainty(profile.geometry, Encoders((1,) * 6), words)
    error = tip_rms_mm(covariance_of(arm, _angles(2000)))
    assert _rms(error) == pytest.approx(0.031, abs=0.002)
    assert error.max() < 0.052


def test_a_covariance_matches_its_cloud() -> None:
    angles = _angles(1, seed=5)[0]
    spread = ParameterSpread()
    arm = ArmUncertainty(GEOMETRY, Encoders((1,) * 6), spread)
    rng = np.random.default_rng(9)
    drawn = [
        KinematicErrorModel.deviating(GEOMETRY, spread.draw(rng)) for _ in range(4000)
    ]
    cloud = np.array([arm_.device_from_tip(angles)[:3, 3] for arm_ in drawn])
    found = np.cov(cloud.T)
    wanted = covariance_of(arm, angles)[:3, :3]
    assert np.abs(found - wanted).max() < 0.08 * np.trace(wanted)


def test_the_common_part_is_the_covariance_without_rounding() -> None:
    angles = _angles(3)
    arm = ArmUncertainty(GEOMETRY, DX40937.encoders, ParameterSpread())
    factor = arm.common_factor(angles)
    np.testing.assert_allclose(
        covariance_of(arm, angles) - arm.quantisation(angles),
        factor @ factor.transpose(0, 2, 1),
        atol=1e-12,
    )


def test_a_joint_without_encoder_adds_nothing() -> None:
    arm = ArmUncertainty(GEOMETRY, DX40937.encoders)
    assert arm.steps()[5] == 0.0
    assert arm.steps()[0] == pytest.approx(2.0 * math.pi / 16384)


def test_negative_spreads_are_refused() -> None:
    with pytest.raises(ValueError, match="not negative"):
        ParameterSpread(length_mm=-1.0)
