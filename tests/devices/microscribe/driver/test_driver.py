import sys
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from devices.controls.pedals import PressCollector
from devices.microscribe import MicroScribe, MicroScribeEmulator
from devices.microscribe.driver.tracker import SampleTracker
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.motion import orbit
from devices.microscribe.emulator.server import EmulatorServer
from devices.microscribe.emulator.socket_port import SocketPort
from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.wire.line import LinkTiming
from devices.port import DeviceError, DeviceReason
from devices.pose import Pose
from devices.recording.path_file import save_probe_path
from devices.recording.probe_path import ProbePath
from devices.registration.fiducial_fit import register
from devices.registration.held_point import HeldPoint
from tests.devices.plugged_arm import Plug

posix = pytest.mark.skipif(
    sys.platform == "win32", reason="pseudo-terminals need POSIX"
)

FIDUCIALS = np.array([[0.0, -85, 45], [38, -60, 20], [-45, -52, 26], [5, -90, -25]])
PATH_PEDAL = 2


def _one_sentence(error: DeviceError) -> bool:
    text = str(error)
    return text.endswith(".") and "\n" not in text and text.count(". ") == 0


@pytest.fixture
def path_file(tmp_path: Path, short_path: ProbePath) -> Path:
    file = tmp_path / "with a blank.path.json"
    save_probe_path(short_path, file)
    return file


@posix
def test_a_registered_flight_follows_the_path(
    path_file: Path, short_path: ProbePath
) -> None:
    press = PressCollector(1)
    touched: list[NDArray[np.float64]] = []
    flight: list[Pose] = []
    with (
        MicroScribeEmulator(path_file, fiducials_mm=FIDUCIALS, seed=3) as emulator,
        MicroScribe(emulator.port_name) as arm,
    ):
        for pose in arm:
            if (held := press.feed(pose)) is not None:
                touched.append(HeldPoint.of(held).tip_mm)
            if pose.buttons & PATH_PEDAL:
                flight.append(pose)
            elif flight:
                break
        assert arm.pose_age_s() < 5.0
        assert arm.counters["refused"] == arm.counters["framing"] == 0
    registration = register(np.array(touched), FIDUCIALS)
    assert registration.residual_rms_mm < 0.2
    begin_s = flight[0].time_s
    times = [pose.time_s - begin_s for pose in flight]
    assert (np.diff(times) > 0.0).all()
    assert times[-1] == pytest.approx(short_path.duration_s, abs=0.2)
    # Rounding to counts errs by 0.31 mm at the very most, by 0.11 mm rms.
    truth = np.linalg.inv(emulator.device_from_world)
    exact = np.array([short_path.sample(t).tip_mm for t in times])
    tips = np.array([(truth @ p.device_from_tip)[:3, 3] for p in flight])
    error = np.linalg.norm(tips - exact, axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.2
    assert error.max() < 0.35
    registered = np.array([registration.world_from_tip(p)[:3, 3] for p in flight])
    error = np.linalg.norm(registered - exact, axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.3
    axes = np.array([-(truth @ p.device_from_tip)[:3, 2] for p in flight])
    wanted = np.array([short_path.sample(t).axis for t in times])
    assert np.degrees(np.arccos(np.sum(axes * wanted, axis=1).min())) < 0.2


@posix
def test_garbage_for_a_while_costs_poses_but_gives_no_wrong_ones(
    path_file: Path, short_path: ProbePath
) -> None:
    flight: list[Pose] = []
    with (
        MicroScribeEmulator(path_file, faults=["garbage@0.4+0.3"]) as emulator,
        MicroScribe(emulator.port_name) as arm,
    ):
        before = None
        for pose in arm:
            if before is not None:
                step = np.linalg.norm(pose.tip_mm - before.tip_mm)
                assert step < 3000.0 * (pose.time_s - before.time_s) + 0.5
            before = pose
            if pose.buttons & PATH_PEDAL:
                flight.append(pose)
            elif flight:
                break
        assert arm.counters["recoveries"] >= 1
    assert flight


@posix
@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("garbage@0.3", DeviceReason.GARBAGE),
        ("mute@0.3", DeviceReason.DISCONNECTED),
        ("unplug@0.3", DeviceReason.DISCONNECTED),
    ],
)
def test_a_fault_for_good_ends_in_one_sentence(
    path_file: Path, fault: str, reason: DeviceReason
) -> None:
    poses: list[Pose] = []
    with (
        MicroScribeEmulator(path_file, faults=[fault]) as emulator,
        MicroScribe(emulator.port_name, timing=LinkTiming(forced_rate=0.3)) as arm,
    ):
        with pytest.raises(DeviceError) as caught:
            poses.extend(arm)
        assert caught.value.reason is reason
        assert _one_sentence(caught.value)
        with pytest.raises(DeviceError):
            arm.latest()
    # What was measured until then has been given out.
    assert 0 < len(poses) < 60


@posix
def test_two_clients_one_after_the_other(path_file: Path) -> None:
    with MicroScribeEmulator(path_file, fast=True) as emulator:
        for _ in range(2):
            with MicroScribe(emulator.port_name, poll_hz=400.0) as arm:
                first, second = arm.read(2.0), arm.read(2.0)
                assert second.time_s > first.time_s
        # Exclusive: a second program is told so.
        with MicroScribe(emulator.port_name):
            with pytest.raises(DeviceError) as caught:
                MicroScribe(emulator.port_name)
            assert caught.value.reason is DeviceReason.NO_PORT


@pytest.mark.parametrize("name", ["/dev/ttyNOSUCH7", "", "bad\0name"])
def test_no_such_port_is_one_sentence(name: str) -> None:
    with pytest.raises(DeviceError) as caught:
        MicroScribe(name)
    assert caught.value.reason is DeviceReason.NO_PORT
    assert _one_sentence(caught.value)


def test_a_mistake_inside_reaches_the_reader(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*packet: object) -> None:
        raise ArithmeticError("broken tracker")

    with MicroScribe(Plug().line.open_port()) as arm:
        arm.read(2.0)
        monkeypatch.setattr(SampleTracker, "accept", broken)
        with pytest.raises(ArithmeticError, match="broken tracker"):
            list(arm)


def test_the_poll_rate_must_be_positive() -> None:
    with pytest.raises(ValueError, match="poll_hz"):
        MicroScribe("nowhere", poll_hz=0.0)


@pytest.mark.slow
@posix
def test_an_arm_at_the_far_end_of_a_network_gives_the_same_poses() -> None:
    firmware = EmulatedArm(DX40937, orbit(DX40937), now_s=time.monotonic())
    port = SocketPort(("127.0.0.1", 0))
    with EmulatorServer(firmware, port) as server, MicroScribe(server.port_name) as arm:
        poses = [arm.read(5.0) for _ in range(30)]
        assert (np.diff([pose.time_s for pose in poses]) > 0).all()
        assert arm.description.identity.serial == DX40937.identity.serial
        assert arm.counters["framing"] == arm.counters["refused"] == 0
        server.stop()
        with pytest.raises(DeviceError) as lost:
            [arm.read(5.0) for _ in range(2000)]
    assert _one_sentence(lost.value)


@pytest.mark.parametrize("name", ["socket://127.0.0.1:1", "nosuch://x", "socket://"])
def test_no_such_address_is_one_sentence(name: str) -> None:
    with pytest.raises(DeviceError) as refused:
        MicroScribe(name)
    assert refused.value.reason is DeviceReason.NO_PORT
    assert _one_sentence(refused.value)
