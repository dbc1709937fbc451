"""Names and rights of serial ports, and what a person reads where one fails."""

import errno
import os
import sys
import time
from pathlib import Path

import pytest
import serial

from devices import serial_adapters as module
from devices.microscribe import MicroScribe
from devices.microscribe.driver import driver
from devices.microscribe.driver.driver import SerialPort
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.emulator.server import EmulatorServer
from devices.microscribe.emulator.terminal_port import TerminalPort
from devices.microscribe.kinematics.profiles import DX40937
from devices.port import DeviceError, DeviceReason
from devices.serial_adapters import (
    absence_remedy,
    latency_ms,
    latency_remedy,
    permission_remedy,
    serial_adapters,
)

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Linux names")

NAME = "usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0"


@pytest.fixture
def machine(tmp_path: Path) -> tuple[Path, Path, Path]:
    """Lays out a device, its lasting name and its latency timer."""
    device = tmp_path / "dev" / "ttyUSB7"
    by_id = tmp_path / "dev" / "serial" / "by-id"
    by_id.mkdir(parents=True)
    device.touch()
    (by_id / NAME).symlink_to("../../ttyUSB7")
    usb = tmp_path / "usb-serial"
    (usb / "ttyUSB7").mkdir(parents=True)
    (usb / "ttyUSB7" / "latency_timer").write_text("16\n")
    return device, by_id, usb


def test_a_port_is_listed_with_its_lasting_name_and_its_timer(
    machine: tuple[Path, Path, Path],
) -> None:
    device, by_id, usb = machine
    (adapter,) = serial_adapters([str(device)], by_id, usb)
    assert adapter.name == str(device)
    assert adapter.by_id == str(by_id / NAME) == adapter.best_name
    assert adapter.latency_ms == 16
    assert adapter.is_allowed
    # The lasting name leads to the same timer.
    assert latency_ms(adapter.by_id, usb) == 16


def test_a_port_without_lasting_name_or_timer(tmp_path: Path) -> None:
    nowhere = tmp_path / "nothing"
    (adapter,) = serial_adapters([str(tmp_path / "ttyS0")], nowhere, nowhere)
    assert adapter.by_id == ""
    assert adapter.best_name == adapter.name
    assert adapter.latency_ms is None
    assert not adapter.is_allowed


@pytest.mark.parametrize("content", ["", "soon\n"])
def test_a_timer_that_cannot_be_read_is_none(
    machine: tuple[Path, Path, Path], content: str
) -> None:
    device, _, usb = machine
    (usb / "ttyUSB7" / "latency_timer").write_text(content)
    assert latency_ms(str(device), usb) is None


def test_the_remedy_for_a_slow_timer_names_its_file(
    machine: tuple[Path, Path, Path],
) -> None:
    _, by_id, usb = machine
    told = latency_remedy(str(by_id / NAME), usb)
    assert f"echo 1 | sudo tee {usb / 'ttyUSB7' / 'latency_timer'} " in told
    assert "docs/arm.md" in told


def test_a_forbidden_port_names_the_group_and_the_rule(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = permission_remedy(str(tmp_path / "nothing"))
    assert "the group dialout" in told
    assert "usermod -aG dialout" in told
    assert "udev rule" in told
    device = tmp_path / "ttyUSB0"
    device.touch(0o660)
    device.chmod(0o660)
    monkeypatch.setattr(module, "_group", lambda name: "uucp")
    assert "usermod -aG uucp" in permission_remedy(str(device))


def test_a_file_of_nobodys_group_falls_back_to_the_usual_one(tmp_path: Path) -> None:
    device = tmp_path / "ttyUSB0"
    device.touch()
    device.chmod(0o600)
    assert "dialout" in permission_remedy(str(device))


def test_where_a_port_is_missing_the_others_are_named(
    machine: tuple[Path, Path, Path],
) -> None:
    device, by_id, _ = machine
    assert absence_remedy([str(device)], by_id) == (
        f"the serial ports now: {by_id / NAME}"
    )
    assert "plug the adapter in" in absence_remedy([], by_id)
    assert os.path.realpath(by_id / NAME) == str(device.resolve())


def _refusal(name: str) -> str:
    with pytest.raises(DeviceError) as caught:
        SerialPort(name)
    assert caught.value.reason is DeviceReason.NO_PORT
    text = str(caught.value)
    assert text.endswith(".")
    assert name in text
    return text


def test_a_lasting_name_opens_the_port_behind_it(tmp_path: Path) -> None:
    """Names under /dev/serial/by-id are links."""
    arm = EmulatedArm(DX40937, StillMotion(DX40937), now_s=time.monotonic())
    with EmulatorServer(arm, TerminalPort()) as server:
        link = tmp_path / "usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0"
        link.symlink_to(server.port_name)
        with MicroScribe(str(link)) as found:
            assert found.description.identity == DX40937.identity
            assert found.baud == 115200
            found.read(5.0)
            assert 0.002 < found.round_trip_s < 0.1


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.EACCES, ["Permission denied", "group dialout", "udev rule", "usermod"]),
        (errno.EPERM, ["group dialout"]),
        (errno.EBUSY, ["another program uses it"]),
        (errno.EAGAIN, ["another program uses it"]),
        (errno.EIO, ["check its name"]),
    ],
)
def test_each_cause_has_its_remedy(
    number: int, words: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: object, **options: object) -> None:
        raise serial.SerialException(number, f"could not open: {os.strerror(number)}")

    monkeypatch.setattr(serial, "Serial", refuse)
    told = _refusal("/dev/ttyNOTHING")
    assert os.strerror(number) in told
    for word in words:
        assert word in told


def test_a_name_that_is_not_there_lists_those_that_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(driver.SerialPorts, "names", lambda self: ["/dev/ttyS7"])
    assert "the serial ports now: /dev/ttyS7" in _refusal("/dev/ttyNOTHING")
    monkeypatch.setattr(driver.SerialPorts, "names", lambda self: [])
    assert "plug the adapter in" in _refusal("/dev/ttyNOTHING")


def test_a_far_port_is_not_looked_for_among_the_near_ones() -> None:
    assert "serial ports now" not in _refusal("socket://127.0.0.1:1")
