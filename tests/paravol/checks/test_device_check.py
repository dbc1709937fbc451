"""Each device is told with what keeps this user from it, and with what helps."""

from pathlib import Path

import pytest

from devices import serial_adapters as serial_module
from devices.port import DeviceError, DeviceReason
from devices.serial_adapters import FTDI, SerialAdapter, udev_rule, usb_numbers
from paravol.checks import device_check
from paravol.checks.device_check import (
    device_findings,
    gamepads,
    serial_permission,
    sound,
)
from system import UserError

CLOSED = SerialAdapter("/dev/ttyUSB0", "", 16, False)
OPEN = SerialAdapter("/dev/ttyUSB0", "", 16, True)


def test_every_device_is_told_with_why_it_matters() -> None:
    found = device_findings()
    names = ["serial ports", "serial permission", "gamepads", "sound", "force devices"]
    assert [finding.name for finding in found] == names
    assert all(finding.why and finding.value for finding in found)
    assert not any(finding.is_missing for finding in found)


def test_who_is_not_in_the_group_reads_the_command_and_the_rule(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(device_check, "serial_group", lambda: ("dialout", False))
    monkeypatch.setattr(device_check, "usb_numbers", lambda name: ("067b", "2303"))
    found = serial_permission([CLOSED])
    assert "sudo usermod -aG dialout $USER" in found.remedy
    assert udev_rule("067b", "2303") in found.remedy.splitlines()
    assert "udevadm control --reload" in found.remedy
    # without an adapter the rule of the usual one is shown
    assert udev_rule(*FTDI) in serial_permission([]).remedy.splitlines()
    assert serial_permission([OPEN]).remedy == ""
    monkeypatch.setattr(device_check, "serial_group", lambda: ("uucp", True))
    assert "uucp" in serial_permission([]).value
    assert serial_permission([]).remedy == ""
    monkeypatch.setattr(device_check, "serial_group", lambda: None)
    assert "no group" in serial_permission([]).value


def test_the_rule_is_the_one_of_the_guide() -> None:
    guide = (Path(__file__).parents[3] / "docs" / "arm.md").read_text()
    assert udev_rule(*FTDI) in guide


def test_an_adapters_numbers_are_found_above_its_port(tmp_path: Path) -> None:
    place = tmp_path / "sys" / "usb1" / "1-2" / "1-2:1.0" / "ttyUSB0"
    place.mkdir(parents=True)
    for file, text in (("idVendor", "0403\n"), ("idProduct", "6015\n")):
        (place.parents[1] / file).write_text(text)
    ports = tmp_path / "usb-serial"
    ports.mkdir()
    (ports / "ttyUSB0").symlink_to(place)
    assert usb_numbers("/dev/ttyUSB0", ports) == ("0403", "6015")
    assert usb_numbers("/dev/ttyS0", ports) is None


def test_membership_is_this_users(monkeypatch: pytest.MonkeyPatch) -> None:
    grp = pytest.importorskip("grp")
    known = serial_module.serial_group()
    if known is None:
        pytest.skip("no group for serial ports here")
    number = grp.getgrnam(known[0]).gr_gid
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    monkeypatch.setattr("os.getegid", lambda: 1000)
    monkeypatch.setattr("os.getgroups", lambda: [4, number])
    assert serial_module.serial_group() == (known[0], True)
    monkeypatch.setattr("os.getgroups", lambda: [4])
    assert serial_module.serial_group() == (known[0], False)


def test_gamepads_that_cannot_be_opened_are_told_with_the_rule(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def refuse(file: Path) -> None:
        raise DeviceError(DeviceReason.NO_PORT, f"{file} cannot be opened.")

    monkeypatch.setattr(device_check, "input_devices", lambda: [tmp_path] * 3)
    monkeypatch.setattr(device_check, "InputDevice", refuse)
    found = gamepads()
    assert "3 of 3 input devices are not yours to open" in found.value
    assert 'TAG+="uaccess"' in found.remedy
    assert "usermod -aG input" in found.remedy

    def elsewhere() -> list[Path]:
        raise DeviceError(DeviceReason.NO_PORT, "Fly with the mouse.")

    monkeypatch.setattr(device_check, "input_devices", elsewhere)
    assert gamepads().remedy == "Fly with the mouse."


def test_silence_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> list[str]:
        raise UserError("No sound: no library.")

    monkeypatch.setattr(device_check, "loudspeakers", refuse)
    assert sound().remedy == "No sound: no library."
    monkeypatch.setattr(device_check, "loudspeakers", lambda: [])
    assert "sound server" in sound().remedy
    monkeypatch.setattr(device_check, "loudspeakers", lambda: ["Built-in", "USB"])
    assert sound().value == "Built-in\nUSB"
    assert sound().remedy == ""
