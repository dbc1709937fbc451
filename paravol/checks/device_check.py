"""Which devices this user may open here, and what gives the right to the others."""

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

from devices import DeviceError
from devices.controls.gamepad import layout_of
from devices.controls.linux_input import InputDevice, input_devices
from devices.haptics.force_dimension import SDK_FOLDER, library_file
from devices.serial_adapters import (
    FTDI,
    LEAST_LATENCY_MS,
    SerialAdapter,
    latency_remedy,
    permission_remedy,
    serial_adapters,
    serial_group,
    udev_rule,
    usb_numbers,
)
from paravol.checks.finding import Finding
from paravol.feedback.sound import loudspeakers
from system import UserError

RULES_FOLDER = "/etc/udev/rules.d"

RELOAD = "sudo udevadm control --reload && sudo udevadm trigger"

GAMEPAD_RULE = 'KERNEL=="event*", ENV{ID_INPUT_JOYSTICK}=="1", TAG+="uaccess"'


def device_findings() -> list[Finding]:
    """Look for what steers, sounds and pushes back, and who may use it."""
    adapters = known_adapters()
    return [
        serial_ports(adapters),
        serial_permission(adapters),
        gamepads(),
        sound(),
        force_devices(),
    ]


def known_adapters() -> list[SerialAdapter]:
    """Return the serial ports of this machine."""
    from devices.microscribe.driver.driver import SerialPorts

    return serial_adapters(SerialPorts().names())


def serial_ports(adapters: list[SerialAdapter]) -> Finding:
    """Report the ports an arm may be at, and what hinders it there."""
    told, remedies = [], []
    for adapter in adapters:
        names = f"{adapter.by_id} ({adapter.name})" if adapter.by_id else adapter.name
        timer = adapter.latency_ms
        told.append(names + (f", latency timer {timer} ms" if timer else ""))
        if not adapter.is_allowed:
            told[-1] += ", not yours to open"
            remedies.append(f"{adapter.name}: {permission_remedy(adapter.name)}.")
        elif timer is not None and timer > LEAST_LATENCY_MS:
            remedies.append(latency_remedy(adapter.name))
    none = "none; a MicroScribe needs one, or a USB adapter"
    return Finding(
        "serial ports",
        "\n".join(told) or none,
        remedy="\n".join(remedies),
        why="a MicroScribe arm speaks through one",
    )


def serial_permission(adapters: list[SerialAdapter]) -> Finding:
    """Say whether this user may open serial ports, and which rule would let him."""
    name, why = "serial permission", "without it an arm is there and cannot be opened"
    group = serial_group()
    if group is None:
        return Finding(name, "no group for it on this system", why=why)
    known, is_member = group
    if is_member:
        return Finding(name, f"you may, by the group {known}", why=why)
    if adapters and all(adapter.is_allowed for adapter in adapters):
        return Finding(name, "you may open the ports that are here", why=why)
    numbers = {usb_numbers(adapter.name) for adapter in adapters} - {None}
    rules = [udev_rule(*pair) for pair in sorted(filter(None, numbers)) or [FTDI]]
    remedy = (
        f"sudo usermod -aG {known} $USER, then log in again. Or, for whoever sits at "
        f"the machine, write to {RULES_FOLDER}/70-microscribe.rules:\n"
        + "\n".join(rules)
        + f"\nand then {RELOAD}"
    )
    return Finding(name, f"you are not in the group {known}", remedy=remedy, why=why)


def pads_among(files: Sequence[Path]) -> tuple[dict[Path, str], int]:
    """Return the names of the gamepads and 3D mice, and how many files are closed."""
    names, closed = {}, 0
    for file in files:
        try:
            device = InputDevice(file)
        except DeviceError:
            closed += 1
            continue
        with closing(device):
            if layout_of(device.description) is not None:
                names[file] = device.description.name
    return names, closed


def gamepads() -> Finding:
    """Say which gamepads and 3D mice there are, and what hides others."""
    why = "--input gamepad steers the scope by one, --instrument the tool"
    try:
        files = input_devices()
    except DeviceError as error:
        return Finding("gamepads", "not on this system", remedy=str(error), why=why)
    names, closed = pads_among(files)
    told = "\n".join(f"{name} ({file})" for file, name in names.items()) or "none"
    if not closed:
        return Finding("gamepads", told, why=why)
    remedy = (
        f"Should one of them be a gamepad: sudo usermod -aG input $USER, then log in "
        f"again. Or write to {RULES_FOLDER}/70-gamepad.rules:\n{GAMEPAD_RULE}\n"
        f"and then {RELOAD}"
    )
    told += f"; {closed} of {len(files)} input devices are not yours to open"
    return Finding("gamepads", told, remedy=remedy if not names else "", why=why)


def sound() -> Finding:
    """Say which loudspeakers there are."""
    why = "tones tell how near a hazard is and how hard a tool presses; bars do, too"
    try:
        names = loudspeakers()
    except UserError as error:
        return Finding("sound", "none", remedy=str(error), why=why)
    if not names:
        remedy = (
            "Plug one in, or start the sound server; over ssh there is none. Flights "
            "need no sound."
        )
        return Finding("sound", "no loudspeaker", remedy=remedy, why=why)
    return Finding("sound", "\n".join(names), why=why)


def force_devices() -> Finding:
    """Say whether the library of real force devices is there; the emulated one is."""
    why = "they push back where a tool touches; a flight does not need one"
    file = library_file()
    if file is None:
        return Finding(
            "force devices",
            "emulated",
            remedy="For one of Force Dimension's install the maker's SDK and set "
            f"{SDK_FOLDER} to its folder.",
            why=why,
        )
    return Finding("force devices", f"emulated; Force Dimension by {file}", why=why)
