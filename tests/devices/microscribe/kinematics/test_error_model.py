import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.microscribe.kinematics.error_model import KinematicErrorModel
from devices.microscribe.kinematics.inverse import UnreachableError
from devices.microscribe.kinematics.jacobian import PARAMETERS
from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.kinematics.uncertainty import ParameterSpread

STATED = DX40937.geometry
HOME = DX40937.encoders.angles(np.array(DX40937.home_counts))


def test_without_deviation_the_arm_is_as_stated() -> None:
    arm = KinematicErrorModel.deviating(STATED, np.zeros(PARAMETERS))
    np.testing.assert_array_equal(
        arm.device_from_tip(HOME), STATED.device_from_tip(HOME)
    )


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_angles_put_the_true_tip_there_and_the_stated_one_beside_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arm = KinematicErrorModel.deviating(
        STATED, ParameterSpread(0.1, 1e-3, 1e-3).draw(rng)
    )
    wanted = STATED.device_from_tip(HOME + rng.uniform(-0.3, 0.3, 6))
    angles = arm.angles(wanted[:3, 3], -wanted[:3, 2], HOME)
    truly = arm.device_from_tip(angles)
    np.testing.assert_allclose(truly[:3, 3], wanted[:3, 3], atol=1e-6)
    np.testing.assert_allclose(truly[:3, 2], wanted[:3, 2], atol=1e-8)
    believed = STATED.device_from_tip(angles)
    assert 1e-3 < np.linalg.norm(believed[:3, 3] - wanted[:3, 3]) < 10.0


def test_out_of_reach_is_said() -> None:
    arm = KinematicErrorModel.deviating(STATED, np.zeros(PARAMETERS))
    with pytest.raises(UnreachableError, match="cannot reach"):
        arm.angles(np.array([900.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0]), HOME)


def test_a_deviation_is_twenty_five_finite_numbers() -> None:
    with pytest.raises(ValueError, match="25 finite numbers"):
        KinematicErrorModel.deviating(STATED, np.zeros(20))
    with pytest.raises(ValueError, match="25 finite numbers"):
        KinematicErrorModel.deviating(STATED, np.full(PARAMETERS, np.nan))
