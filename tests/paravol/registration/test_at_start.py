from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from devices import Pose, PoseFlag, RegistrationError
from devices.microscribe.kinematics.profiles import DX40937, SECOND_3DX
from devices.microscribe.wire.link import ArmDescription
from paravol.registration.at_start import (
    TippedPoses,
    register_by_touch,
    registered_by_file,
)
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


Entry = tuple[bool, NDArray[np.float64], PoseFlag]

PLACES = {
    "a": np.zeros(3),
    "b": np.array([60.0, 0.0, 0.0]),
    "c": np.array([0.0, 40.0, 0.0]),
    "d": np.array([0.0, 0.0, 50.0]),
}
PAUSE: list[Entry] = [(False, np.zeros(3), PoseFlag.NONE)] * 5


def _hold(
    place: NDArray[np.float64],
    count: int = 20,
    speed_mm: float = 0.0,
    flag: PoseFlag = PoseFlag.NONE,
) -> list[Entry]:
    shift = np.array([speed_mm, 0.0, 0.0])
    return [(True, place + i * shift, flag) for i in range(count)] + PAUSE


class Hand:
    """An arm whose pedal and tip follow a list, 100 times a second."""

    def __init__(self, wrong: list[Entry]) -> None:
        right = [entry for place in PLACES.values() for entry in _hold(place)]
        self._entries = [*PAUSE, *wrong, *right]
        self._count = 0

    def read(self, timeout_s: float) -> Pose:
        down, tip, flag = self._entries[self._count]
        self._count += 1
        frame = np.eye(4)
        frame[:3, 3] = tip
        return Pose(0.01 * self._count, 0.0, frame, int(down), flag)


@pytest.mark.parametrize(
    "wrong",
    [
        [],
        *(_hold(PLACES["d"], count) for count in range(1, 11)),
        _hold(PLACES["d"], speed_mm=1.0),
        _hold(PLACES["d"], flag=PoseFlag.JUMP),
    ],
)
def test_each_press_at_rest_is_a_touch(wrong: list[Entry]) -> None:
    """Not chatter, nor a stylus that slips, nor poses that may be wrong."""
    found = register_by_touch(Hand(wrong), PLACES, lambda stage, share: None)
    np.testing.assert_allclose(found.world_from_device, np.eye(4), atol=1e-9)
