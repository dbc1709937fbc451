"""What Linux knows of the adapters that serial ports hang on.

The names under ``/dev/serial/by-id`` stay the same wherever an adapter is plugged in.
An FTDI chip hands over what it received only after its latency timer, 16 ms unless
somebody set it, which keeps a polled arm near 60 poses a second.
"""

import os
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

BY_ID = Path("/dev/serial/by-id")
USB_SERIAL = Path("/sys/bus/usb-serial/devices")

LEAST_LATENCY_MS = 1
USUAL_GROUP = "dialout"
GROUPS = USUAL_GROUP, "uucp"
"""Whose members may open serial ports: on Debian and Fedora, on Arch."""

FTDI = "0403", "6001"
"""USB's numbers of the chip in the adapters that are most often sold."""

PAGE = "docs/arm.md"


@dataclass(frozen=True, slots=True)
class SerialAdapter:
    """One serial port of this machine."""

    name: str
    """What the kernel calls it, such as /dev/ttyUSB0."""
    by_id: str
    """A name that stays the same, empty where there is none."""
    latency_ms: int | None
    """The chip's latency timer, None where it has none."""
    is_allowed: bool
    """Whether this user may read and write it."""

    @property
    def best_name(self) -> str:
        """Return the name to give to a command."""
        return self.by_id or self.name


def serial_adapters(
    names: Sequence[str], by_id: Path = BY_ID, usb_serial: Path = USB_SERIAL
) -> list[SerialAdapter]:
    """Return what is known of the ports of those names."""
    lasting = _lasting_names(by_id)
    return [
        SerialAdapter(
            name,
            lasting.get(os.path.realpath(name), ""),
            latency_ms(name, usb_serial),
            os.access(name, os.R_OK | os.W_OK),
        )
        for name in names
    ]


def latency_ms(name: str, usb_serial: Path = USB_SERIAL) -> int | None:
    """Return the latency timer of a port's chip; None where it has none.

    ``name`` may be a link, such as those under ``/dev/serial/by-id``.
    """
    device = Path(os.path.realpath(name)).name
    try:
        return int((usb_serial / device / "latency_timer").read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def latency_remedy(name: str, usb_serial: Path = USB_SERIAL) -> str:
    """Return the command that sets a port's latency timer to its least."""
    file = usb_serial / Path(os.path.realpath(name)).name / "latency_timer"
    return (
        f"echo {LEAST_LATENCY_MS} | sudo tee {file} sets it to {LEAST_LATENCY_MS} ms "
        f"until the adapter is pulled; {PAGE} has a udev rule that lasts."
    )


def permission_remedy(name: str) -> str:
    """Return what lets this user open the port of that name."""
    group = _group(name) or USUAL_GROUP
    return (
        f"it belongs to the group {group}: `sudo usermod -aG {group} $USER`, then log "
        f"in again, or install the udev rule of {PAGE}"
    )


def usb_numbers(name: str, usb_serial: Path = USB_SERIAL) -> tuple[str, str] | None:
    """Return USB's numbers of a port's adapter, vendor and product; None without any.

    Four hexadecimal digits each.
    """
    place = Path(os.path.realpath(usb_serial / Path(os.path.realpath(name)).name))
    for folder in (place, *place.parents):
        try:
            vendor, product = (
                (folder / file).read_text(encoding="ascii").strip()
                for file in ("idVendor", "idProduct")
            )
        except (OSError, ValueError):
            continue
        return vendor, product
    return None


def udev_rule(vendor: str, product: str) -> str:
    """Return the rule that gives an adapter to whoever sits at the machine."""
    return (
        f'SUBSYSTEM=="tty", ATTRS{{idVendor}}=="{vendor}", '
        f'ATTRS{{idProduct}}=="{product}", TAG+="uaccess"'
    )


def serial_group() -> tuple[str, bool] | None:
    """Return the group that may open serial ports and whether this user is in it.

    None where there is no such group.
    """
    try:
        import grp
    except ImportError:
        return None
    for name in GROUPS:
        try:
            number = grp.getgrnam(name).gr_gid
        except KeyError:
            continue
        mine = {os.getegid(), *os.getgroups()}
        return name, os.geteuid() == 0 or number in mine
    return None


def absence_remedy(names: Sequence[str], by_id: Path = BY_ID) -> str:
    """Return which ports there are instead of one that is not there."""
    there = [adapter.best_name for adapter in serial_adapters(names, by_id)]
    if not there:
        return "this machine has no serial port now; plug the adapter in"
    return f"the serial ports now: {', '.join(there)}"


def _lasting_names(by_id: Path) -> dict[str, str]:
    """Return the lasting name of each device that has one."""
    try:
        return {os.path.realpath(link): str(link) for link in sorted(by_id.iterdir())}
    except OSError:
        return {}


def _group(name: str) -> str:
    """Return the group whose members may open the port, empty where none may."""
    try:
        import grp

        about = Path(name).stat()
        if not about.st_mode & stat.S_IWGRP or about.st_gid == 0:
            return ""
        return grp.getgrgid(about.st_gid).gr_name
    except (ImportError, KeyError, OSError):
        return ""
