"""An arm as input: registered by touch, or by a file made before."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from app.inputs import choose_input
from app.inputs.arm import ArmInput
from app.operating_room import OperatingRoom
from devices import Pose, RegistrationError, load_probe_path
from devices.microscribe.link import ArmDescription
from devices.microscribe.profiles import DX40937
from scenarios import load_scenario

SCENARIO, FOLDER = load_scenario("first_flight")
PATH_FILE = FOLDER / SCENARIO.path
PATH = load_probe_path(PATH_FILE)
Shifted = Callable[[str], Path]
ROOM = cast(OperatingRoom, None)
"""No arm looks at it."""


class Still:
    description = ArmDescription(DX40937.identity, DX40937.maxima, DX40937.geometry)

    def read(self, timeout_s: float) -> Pose:
        return Pose(1.0, 2.0, np.eye(4), 1)


@pytest.fixture
def still_arm(monkeypatch: pytest.MonkeyPatch) -> Still:
    arm = Still()

    @contextmanager
    def open_arm(*args: Any, **options: Any) -> Iterator[Still]:
        yield arm

    monkeypatch.setattr("app.inputs.arm.open_arm", open_arm)
    return arm


def test_without_a_file_the_arm_is_taken_as_it_is(still_arm: Still) -> None:
    flown = ArmInput(SCENARIO, PATH, PATH_FILE, "/dev/ttyUSB0")
    with flown.open(ROOM) as poses:
        assert poses is cast(object, still_arm)
    assert flown.registration is None


def test_a_file_registers_and_moves_the_tip(
    still_arm: Still, shifted_file: Shifted
) -> None:
    file = shifted_file(DX40937.identity.serial)
    flown = choose_input("emulator", "/dev/ttyUSB0", SCENARIO, PATH, PATH_FILE, file)
    with flown.open(ROOM) as poses:
        assert flown.registration is not None
        tip = flown.registration.world_from_tip(poses.read(1.0))[:3, 3]
    np.testing.assert_allclose(tip, (10.0, 20.0, 16.0))


def test_the_file_of_another_arm_is_refused(
    still_arm: Still, shifted_file: Shifted
) -> None:
    file = shifted_file("another")
    flown = ArmInput(SCENARIO, PATH, PATH_FILE, "/dev/ttyUSB0", file)
    with pytest.raises(RegistrationError, match="another"), flown.open(ROOM):
        pass


def test_a_file_that_is_none_is_refused_before_anything_is_opened(
    tmp_path: Path,
) -> None:
    with pytest.raises(RegistrationError):
        ArmInput(SCENARIO, PATH, PATH_FILE, None, tmp_path / "nothing.json")


def test_only_arms_are_registered(shifted_file: Shifted) -> None:
    file = shifted_file("any")
    with pytest.raises(ValueError, match="--registration is for an arm"):
        choose_input("mouse", None, SCENARIO, PATH, PATH_FILE, file)


def test_no_file_knows_where_the_emulated_arm_stands(shifted_file: Shifted) -> None:
    file = shifted_file(DX40937.identity.serial)
    with pytest.raises(ValueError, match="the emulated arm stands elsewhere"):
        choose_input("emulator", None, SCENARIO, PATH, PATH_FILE, file)
