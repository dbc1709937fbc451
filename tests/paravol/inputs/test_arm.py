"""An arm as input: registered by touch, or by a file made before."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices import DeviceError, Pose, RegistrationError, load_probe_path
from devices.controls.roll import EncoderRoll
from devices.microscribe.kinematics.profiles import DX40937, SIX_JOINTS
from devices.microscribe.wire.link import ArmDescription
from devices.openigtlink import PoseStreamer
from paravol.inputs import choose_input
from paravol.inputs.arm import ArmInput
from paravol.inputs.flight_input import POST_IS_Y_DEG, in_the_patient
from paravol.patient import PatientScene
from scenarios import load_scenario

SCENARIO, FOLDER = load_scenario("first_flight")
PATH_FILE = FOLDER / SCENARIO.path
PATH = load_probe_path(PATH_FILE)
Shifted = Callable[[str], Path]
ROOM = cast(PatientScene, None)
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

    monkeypatch.setattr("paravol.inputs.arm.open_arm", open_arm)
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
    flown = choose_input(None, "/dev/ttyUSB0", SCENARIO, PATH, PATH_FILE, file)
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


class Turning(Still):
    """A six-joint arm whose stylus is turned on by 20 degrees from pose to pose."""

    description = ArmDescription(
        SIX_JOINTS.identity, SIX_JOINTS.maxima, SIX_JOINTS.geometry
    )
    count = 0

    def read(self, timeout_s: float) -> Pose:
        self.count += 1
        # the shaft leans back from the patient's long axis, roll about its own
        turn = Rotation.from_euler("XZ", [-60.0, 20.0 * self.count], degrees=True)
        frame = np.eye(4)
        frame[:3, :3] = turn.as_matrix()
        return Pose(self.count * 1.0, self.count + 1.0, frame, 0)


def test_a_sixth_encoder_turns_the_scope_from_where_it_was_clamped(
    still_arm: Still, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = Turning()
    monkeypatch.setattr(
        "paravol.inputs.arm.open_arm", lambda *_, **__: nullcontext(arm)
    )
    flown = choose_input(
        None, "/dev/ttyUSB0", SCENARIO, PATH, PATH_FILE, roll="encoder"
    )
    with flown.open(ROOM) as poses:
        assert flown.completer.complete(poses.read(1.0)).roll_deg == 0.0
        flown.placed(in_the_patient())
        rolls = [flown.completer.complete(poses.read(1.0)).roll_deg for _ in range(30)]
    # right-handed about the pointing direction is left-handed about the shaft's back,
    # and it runs on over half turns
    np.testing.assert_allclose(rolls, -20.0 * np.arange(30), atol=1e-9)


def test_a_five_joint_arm_has_no_sixth_encoder(still_arm: Still) -> None:
    flown = ArmInput(SCENARIO, PATH, PATH_FILE, "/dev/ttyUSB0", roll="encoder")
    with pytest.raises(DeviceError, match="no sixth encoder"), flown.open(ROOM):
        pass


def test_a_second_device_turns_the_scope(still_arm: Still) -> None:
    """A peer streams a tool that is turned by 35 degrees about its shaft."""
    upright = np.eye(4)
    upright[:3, :3] = Rotation.from_euler("x", -60, degrees=True).as_matrix()
    turned = upright.copy()
    turned[:3, :3] @= Rotation.from_euler("z", 35, degrees=True).as_matrix()
    # the light post, y, is up in `upright`: the roll of the frame that is turned
    expected = cast(float, EncoderRoll(np.eye(4), POST_IS_Y_DEG).roll_deg(told(turned)))
    with PoseStreamer(0) as streamer:
        words = f"igtl:127.0.0.1:{streamer.port}:Scope"
        flown = ArmInput(SCENARIO, PATH, PATH_FILE, "/dev/ttyUSB0", roll=words)
        stop = threading.Event()
        sender = threading.Thread(target=keep_telling, args=(streamer, turned, stop))
        sender.start()
        try:
            with flown.open(ROOM):
                found = until_known(flown)
        finally:
            stop.set()
            sender.join()
    assert found == pytest.approx(expected, abs=1e-3)
    assert abs(found) > 1.0


def told(frame: NDArray[np.float64]) -> Pose:
    return Pose(0.0, time.monotonic(), frame, 0)


def keep_telling(
    streamer: PoseStreamer, frame: NDArray[np.float64], stop: threading.Event
) -> None:
    while not stop.wait(0.01):
        streamer.publish("Scope", frame, time.monotonic())


def until_known(flown: ArmInput) -> float:
    for _ in range(2000):
        found = flown.completer.complete(told(np.eye(4))).roll_deg
        if found != 0.0:
            return found
        time.sleep(0.01)
    raise AssertionError("no roll came from the peer within 20 s")


@pytest.mark.parametrize("words", ["", "keys", "igtl", "igtl:host", "encoder:1"])
def test_other_sources_of_roll_are_refused(words: str) -> None:
    with pytest.raises(ValueError, match="--roll"):
        ArmInput(SCENARIO, PATH, PATH_FILE, "/dev/ttyUSB0", roll=words)


def test_only_a_real_arm_needs_to_be_told_its_roll() -> None:
    with pytest.raises(ValueError, match="--roll"):
        choose_input("mouse", None, SCENARIO, PATH, PATH_FILE, roll="encoder")


def test_no_file_knows_where_the_emulated_arm_stands(shifted_file: Shifted) -> None:
    file = shifted_file(DX40937.identity.serial)
    with pytest.raises(ValueError, match="the emulated arm stands elsewhere"):
        choose_input("emulator", None, SCENARIO, PATH, PATH_FILE, file)
