from pathlib import Path

import msgspec
import numpy as np
import pytest

from app.registering import TippedPoses, head_of, registered_by_file
from devices import Pose, RegistrationError
from devices.microscribe.link import ArmDescription
from devices.microscribe.profiles import DX40937, SECOND_3DX
from devices.registration_file import RegistrationRecord, save_registration
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
def file(tmp_path: Path, scenario: Scenario) -> Path:
    """A registration that shifts by (10, 20, 30), with a tip 14 mm longer."""
    transform = np.eye(4)
    transform[:3, 3] = (10.0, 20.0, 30.0)
    path = tmp_path / "r.json"
    save_registration(
        path,
        RegistrationRecord(
            world_from_device=tuple(transform.ravel().tolist()),
            tip_mm=(0.0, 0.0, -14.0),
            arm_serial=DX40937.identity.serial,
            arm_model="DX",
            head=head_of(scenario),
            created="2000-01-01T00:00:00+00:00",
            landmarks=(),
            residual_rms_mm=0.2,
            traced_points=0,
            surface_rms_mm=0.0,
            targets={},
            budget_mm=0.75,
        ),
    )
    return path


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
