"""A tool of another program as the endoscope, in the patient's frame or registered."""

import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from devices import ProbePath, RegistrationError
from devices.openigtlink import PoseStreamer
from devices.registration.registration_file import load_registration, save_registration
from paravol.inputs.igtl import LinkInput, peer_address
from paravol.registration.at_start import TRACKER, head_of
from scenarios import Scenario, load_scenario

Exercise = tuple[Scenario, ProbePath]


@pytest.fixture
def tracker_file(shifted_file: Callable[[str], Path]) -> Path:
    """Registers the tool Pointer: shifts by (10, 20, 30), with a tip 14 mm longer."""
    file = shifted_file("Pointer")
    record = load_registration(file)
    save_registration(file, msgspec.structs.replace(record, arm_model=TRACKER))
    return file


def test_a_registered_tool_is_followed_at_its_tip(tracker_file: Path) -> None:
    scenario, _ = load_scenario("first_flight")
    frame = np.eye(4)
    frame[:3, 3] = (1.0, 2.0, 3.0)
    with PoseStreamer(0) as streamer:
        link = LinkInput("127.0.0.1", streamer.port, None, scenario, tracker_file)
        assert link.registration is not None
        assert link.registration.world_from_device[:3, 3].tolist() == [10.0, 20.0, 30.0]
        with link.open(patient=None) as poses:  # type: ignore[arg-type]
            until = time.monotonic() + 10.0
            while not streamer.peers:
                assert time.monotonic() < until
                time.sleep(0.005)
            streamer.publish("Other", np.eye(4), time.monotonic())
            streamer.publish("Pointer", frame, time.monotonic())
            # The file names the tool; its tip is 14 mm ahead.
            assert poses.read(10.0).tip_mm == pytest.approx((1.0, 2.0, -11.0))


def test_without_a_file_the_poses_are_in_the_patient(exercise: Exercise) -> None:
    link = LinkInput("localhost", 18944, None, exercise[0])
    assert link.registration is not None
    assert (link.registration.world_from_device == np.eye(4)).all()


def test_a_file_of_another_device_tool_or_head_is_refused(
    tracker_file: Path, shifted_file: Callable[[str], Path]
) -> None:
    scenario, _ = load_scenario("first_flight")
    address = peer_address("--input", "localhost:18944")[:2]
    with pytest.raises(RegistrationError, match="tool 'Pointer', this is 'Scope'"):
        LinkInput(*address, "Scope", scenario, tracker_file)
    other = msgspec.structs.replace(scenario, name="another")
    with pytest.raises(RegistrationError, match="head"):
        LinkInput(*address, None, other, tracker_file)
    assert head_of(other) != head_of(scenario)
    with pytest.raises(RegistrationError, match="device 'DX', this is 'OpenIGTLink'"):
        LinkInput(*address, None, scenario, shifted_file("EMU00001"))
