"""The arm on the table: a real one on a serial port, or the emulated one."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from devices.microscribe import MicroScribe, MicroScribeEmulator
from devices.microscribe.driver.driver import SerialPort, SerialPorts
from paravol.checks.known_constants import require_known_constants
from scenarios import Scenario
from system import UserError


def require_port(device: str | None) -> None:
    """Raise DeviceError for a serial port that cannot be opened; None is no port.

    Asked before anything slow begins. A port at the far end of a network is left alone.
    """
    if device is not None and "://" not in device:
        SerialPort(device).close()


@contextmanager
def arm_at(device: str) -> Iterator[MicroScribe]:
    """Open the arm at a port, whose constants must be those of the last time.

    DeviceError, in one sentence, when there is none or they changed. Unplugged in
    use, it is looked for until it is there again.
    """
    with MicroScribe(device, replug=SerialPorts()) as arm:
        require_known_constants(arm.description, device)
        yield arm


@contextmanager
def open_arm(
    scenario: Scenario,
    path_file: Path | None,
    *,
    device: str | None,
    faults: tuple[str, ...] = (),
) -> Iterator[MicroScribe]:
    """Open the arm at `device`, or start the emulated one and open that.

    The emulated arm runs in a process of its own, touches the scenario's fiducials
    and then follows the path. DeviceError, in one sentence, when there is no arm.
    Unplugged in use, either is looked for until it is there again.
    """
    if device is not None:
        if faults:
            raise UserError(
                "--fault makes the emulated arm misbehave; leave out --device for it."
            )
        with arm_at(device) as arm:
            yield arm
        return
    assert path_file is not None  # an input without a path was refused
    positions = [f.position_mm for f in scenario.fiducials]
    with (
        MicroScribeEmulator(
            path_file, fiducials_mm=np.array(positions), seed=1, faults=faults
        ) as emulator,
        MicroScribe(emulator.port_name, replug=emulator) as arm,
    ):
        yield arm
