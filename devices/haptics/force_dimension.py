"""Force Dimension's devices (omega, sigma, lambda, delta) through the maker's library.

The library, libdhd, comes with the maker's SDK and is called directly: the Python
package `forcedimension-core` binds the same functions, but calls them with the
interpreter's lock and is licensed otherwise than this program. Signatures are those of
SDK 3.16. Nothing of this has met a device yet: see docs/haptics.md.
"""

import ctypes
import ctypes.util
import os
import platform
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devices.haptics.force_port import ForceLimits
from devices.port import DeviceError, DeviceReason

WANTED = (
    *("dhdOpen", "dhdClose", "dhdErrorGetLastStr", "dhdGetSystemName"),
    *("dhdHasWrist", "dhdEnableForce", "dhdGetMaxForce"),
    *("dhdGetPositionAndOrientationFrame", "dhdGetButtonMask", "dhdSetForce"),
)
"""What is called of the library; one that lacks any is too old."""

SDK_FOLDER = "FDSDK"
"""Environment variable that names the SDK's folder, as the maker's own tools read."""

STIFFNESS_N_M = 2000.0
"""Stiffest wall that is asked of these devices. The maker tells 14.5 N/mm for an omega,
damped by its own controller; a hand damps little, so much less is used."""

FORCE_N = 12.0
"""Largest force where the library tells none: an omega's."""


def library_file() -> str | None:
    """Return where the library is, None where there is none.

    In the SDK's folder that `FDSDK` names, or where the system looks for libraries.
    """
    folder = os.environ.get(SDK_FOLDER)
    if folder:
        built = Path(folder) / "lib" / "release" / f"lin-{platform.machine()}-gcc"
        # libdrd holds all of libdhd and more
        for name in ("libdhd.so*", "libdrd.so*"):
            found = sorted(built.glob(name)) or sorted(Path(folder).glob(name))
            if found:
                return str(found[-1])
    return ctypes.util.find_library("dhd") or ctypes.util.find_library("drd")


def load_library() -> Any:
    """Load the library for the whole process; DeviceError where that cannot be."""
    file = library_file()
    if file is None:
        raise DeviceError(
            DeviceReason.NO_PORT,
            "Force Dimension's library libdhd is not installed; install the maker's "
            f"SDK 3.16 or newer and set {SDK_FOLDER} to its folder.",
        )
    try:
        # global, so that compiled code finds its functions
        library = ctypes.CDLL(file, mode=ctypes.RTLD_GLOBAL)
    except OSError as error:
        raise DeviceError(
            DeviceReason.NO_PORT, f"{file} cannot be loaded: {error}"
        ) from error
    missing = [name for name in WANTED if not hasattr(library, name)]
    if missing:
        raise DeviceError(
            DeviceReason.UNSUPPORTED_FORMAT,
            f"{file} lacks {', '.join(missing)}; install the SDK 3.16 or newer.",
        )
    library.dhdErrorGetLastStr.restype = ctypes.c_char_p
    library.dhdGetSystemName.restype = ctypes.c_char_p
    library.dhdGetMaxForce.restype = ctypes.c_double
    return library


class ForceDimension:
    """One open device; a `ForceDevice`."""

    def __init__(self, library: Any, number: int) -> None:
        """Take a device that is open; see `open`."""
        # only now: what it compiles needs the library's symbols
        from devices.haptics.kernels.dhd_calls import DEVICE, linked

        self._library = library
        self._number = ctypes.c_byte(number)
        self._is_open = True
        told = library.dhdGetSystemName(self._number)
        self.name = f"Force Dimension {(told or b'unnamed').decode(errors='replace')}"
        largest = float(library.dhdGetMaxForce(self._number))
        force_n = largest if 0.0 < largest < np.inf else FORCE_N
        self.limits = ForceLimits(force_n, STIFFNESS_N_M)
        self._state: NDArray[Any] = np.zeros(1, DEVICE)
        self._state["id"] = number
        self._linked = linked()
        self.read_address = self._linked.read_address
        self.command_address = self._linked.command_address
        self.state_address = int(self._state.ctypes.data)

    @classmethod
    def open(cls) -> "ForceDimension":
        """Open the first device that is free and turn its forces on.

        DeviceError where the library or a device is missing, or the device has no
        wrist: a scope needs a direction.
        """
        library = load_library()
        number = int(library.dhdOpen())
        if number < 0:
            raise DeviceError(
                DeviceReason.NO_DEVICE,
                f"No Force Dimension device can be opened ({_why(library)}); switch it "
                "on, end other programs that use it and look whether you may read its "
                "USB port.",
            )
        short = ctypes.c_byte(number)
        if not library.dhdHasWrist(short):
            library.dhdClose(short)
            raise DeviceError(
                DeviceReason.WRONG_DEVICE,
                "This Force Dimension device has no wrist, so it does not say where a "
                "scope points; a device with six degrees of freedom is needed.",
            )
        if library.dhdEnableForce(ctypes.c_bool(True), short) < 0:
            why = _why(library)
            library.dhdClose(short)
            raise DeviceError(
                DeviceReason.CANT_BEGIN, f"The device turns no forces on ({why})."
            )
        return cls(library, number)

    def close(self) -> None:
        """Take the force away and let go of the device; harmless when repeated."""
        if self._is_open:
            self._is_open = False
            zero = ctypes.c_double(0.0)
            self._library.dhdSetForce(zero, zero, zero, self._number)
            self._library.dhdEnableForce(ctypes.c_bool(False), self._number)
            self._library.dhdClose(self._number)


def _why(library: Any) -> str:
    """Return what the library says of its last error."""
    told = library.dhdErrorGetLastStr()
    return (told or b"no reason told").decode(errors="replace")
