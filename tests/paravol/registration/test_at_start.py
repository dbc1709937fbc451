from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from devices import Pose, RegistrationError
from devices.microscribe.kinematics.profiles import DX40937, SECOND_3DX
from devices.microscribe.wire.link import ArmDescription
from paravol.registration.at_start import TippedPoses, registered_by_file
from scenarios import Scenario, load_scenario

ARM = ArmDescription(DX40937.identity, DX40937.maxima, DX40937.geometry)
OTHER = ArmDescription(SECOND_3DX.identity, SECOND_3DX.maxima, SECOND_3DX.geometry)


class Still:
    def read(self, timeout_s: float) -> Pose:
        return Pose(1.0, 2.0, np.eye(4), 1)


@pytest.fixture
def scenario() -> Scenario:
    return load_scenario("first_flight")[0]


@pytest.fixture
def file(shifted_file: Callable[[str], Path]) -> Path:
    """Of the arm with which the tests fly."""
    return shifted_file(DX40937.identity.serial)


def test_a_file_gives_the_place_of_its_tip(file: Path, scenario: Scenario) -> None:
    poses, registration = registered_by_file(Still(), file, ARM, scenario)
    pose = poses.read(1.0)
    assert pose.buttons == 1
    tip = registration.world_from_tip(pose)[:3, 3]
    np.testing.assert_allclose(tip, (10.0, 20.0, 16.0))


def test_another_arm_or_head_is_refused(file: Path, scenario: Scenario) -> None:
    with pytest.raises(RegistrationError, match="registers the arm 'EMU00001'"):
        registered_by_file(Still(), file, OTHER, scenario)
    other = msgspec.structs.replace(scenario, name="another")
    with pytest.raises(RegistrationError, match="registers the head 'first_flight"):
        registered_by_file(Still(), file, ARM, other)


def test_a_known_tip_leaves_the_poses_alone() -> None:
    pose = TippedPoses(Still(), np.zeros(3)).read(1.0)
    np.testing.assert_array_equal(pose.device_from_tip, np.eye(4))
