"""What could move the scope."""

from pathlib import Path

import pytest

from paravol.exercises.training_setup import DeviceSetup
from paravol.trainee import found_devices
from paravol.trainee.found_devices import FoundDevice, find_devices


def test_mouse_and_emulator_are_always_there() -> None:
    found = [device.words for device in find_devices()]
    assert found[0] == "mouse"
    assert found[-1] == "emulator"
    assert len(set(found)) == len(found)


def test_a_port_is_offered_with_what_stands_in_its_way(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    port = tmp_path / "ttyUSB7"
    monkeypatch.setattr(
        "devices.microscribe.driver.driver.SerialPorts.names", lambda _: [str(port)]
    )
    (closed,) = [d for d in find_devices() if d.port is not None]
    assert closed.port == str(port)
    assert str(port) in closed.problem  # nobody may open what is not there
    port.touch()
    (open_,) = [d for d in find_devices() if d.port is not None]
    assert open_.problem == ""


def test_what_belongs_to_an_arm_goes_with_an_arm_only() -> None:
    typed = DeviceSetup(
        scope=None, port="/dev/a", registration=Path("r.json"), roll="wheel"
    )
    assert found_devices.MOUSE.chosen(typed) == DeviceSetup(scope="mouse")
    arm = FoundDevice("arm:/dev/b", "an arm").chosen(typed)
    assert arm == DeviceSetup(port="/dev/b", registration=Path("r.json"), roll="wheel")
    force = FoundDevice("force-dimension", "a force device").chosen(typed)
    assert force == DeviceSetup(haptics="force-dimension")
