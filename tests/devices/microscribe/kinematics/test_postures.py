"""Postures lie near the poses of an arm, however it deviates."""

import numpy as np
import pytest

from devices.microscribe.kinematics.postures import WRIST_AXES, likely_postures
from devices.microscribe.kinematics.profiles import (
    DX40937,
    NOMINAL,
    SECOND_3DX,
    ArmProfile,
)


@pytest.mark.parametrize("arm", [NOMINAL, DX40937, SECOND_3DX])
def test_nine_of_ten_poses_have_a_posture_near_them(arm: ArmProfile) -> None:
    rng = np.random.default_rng(0)
    farthest = []
    for held in rng.uniform(0.0, 2.0 * np.pi, (200, 6)):
        held[5] = 0.0
        frame = arm.geometry.device_from_tip(held)
        postures = likely_postures(arm.geometry, frame[:3, 3], -frame[:3, 2])
        turns = np.remainder(postures - held + np.pi, 2.0 * np.pi) - np.pi
        farthest.append(np.abs(turns).max(axis=1).min())
    # The wrist's axis is within half a step of one that is tried. Joints follow it, but
    # for a few poses in which little moves much: there stylus and forearm are nearly in
    # line, or the arm is stretched.
    assert np.quantile(farthest, 0.9) < np.pi / WRIST_AXES
