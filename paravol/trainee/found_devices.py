"""What could move the scope now: mouse, emulated arm, and what is plugged in.

Looking opens input devices and asks the system for its ports, which takes up to some
tenths of a second; nothing is sent to a serial port.
"""

from dataclasses import dataclass, replace

from devices import DeviceError
from devices.controls.linux_input import input_devices
from devices.haptics.force_dimension import library_file
from devices.serial_adapters import permission_remedy
from paravol.checks.device_check import known_adapters, pads_among
from paravol.exercises.training_setup import DeviceSetup

ARM = "arm:"
FORCE = "force-dimension"


@dataclass(frozen=True, slots=True)
class FoundDevice:
    """A way to move the scope.

    words: how it is chosen, as for `--input`; "arm:PORT" for a MicroScribe at a port,
    "force-dimension" for a force device. title: for people. problem: why it cannot be
    used as it is, with the remedy; "" where it can.
    """

    words: str
    title: str
    problem: str = ""

    @property
    def scope(self) -> str | None:
        """Return the words of `--input`; None for an arm or a force device."""
        return None if self.words.startswith((ARM, FORCE)) else self.words

    @property
    def port(self) -> str | None:
        """Return the port of an arm; None for anything else."""
        return self.words.removeprefix(ARM) if self.words.startswith(ARM) else None

    def chosen(self, typed: DeviceSetup) -> DeviceSetup:
        """Return the devices of a training with this one.

        typed: what the command line says; what belongs to an arm goes with one only.
        """
        port = self.port
        haptics = FORCE if self.words == FORCE else "none"
        registration = roll = None
        if port is not None:
            registration, roll = typed.registration, typed.roll
        return replace(
            typed,
            scope=self.scope,
            port=port,
            registration=registration,
            roll=roll,
            haptics=haptics,
            haptics_fault=None,
        )


MOUSE = FoundDevice("mouse", "Mouse and keyboard")
EMULATOR = FoundDevice("emulator", "Emulated arm (flies a recorded path)")


def find_devices() -> list[FoundDevice]:
    """Return what could move the scope, the mouse first."""
    return [MOUSE, *_pads(), *_arms(), *_force_devices(), EMULATOR]


def _pads() -> list[FoundDevice]:
    try:
        # keyboards and mice of others are no business of ours
        found, _ = pads_among(input_devices())
    except DeviceError:
        return []
    return [FoundDevice(f"gamepad:{file}", name) for file, name in found.items()]


def _arms() -> list[FoundDevice]:
    found = []
    for adapter in known_adapters():
        problem = ""
        if not adapter.is_allowed:
            problem = f"{adapter.name}: {permission_remedy(adapter.name)}."
        title = f"MicroScribe at {adapter.name}"
        found.append(FoundDevice(f"{ARM}{adapter.best_name}", title, problem))
    return found


def _force_devices() -> list[FoundDevice]:
    """Return a force device where its maker's library is; whether one is there, too,
    is known when it is opened."""
    if library_file() is None:
        return []
    return [FoundDevice(FORCE, "Force Dimension (pushes back)")]
