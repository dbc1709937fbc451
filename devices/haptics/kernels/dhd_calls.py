"""Compiled: what a force loop calls of Force Dimension's library, libdhd.

The library is the maker's and comes with its SDK; its functions are found among the
process's symbols. So nothing here is compiled before the library is loaded
(`devices.haptics.force_dimension`): `linked` does that.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import carray, cfunc, from_dtype, types  # type: ignore[attr-defined]

from devices.haptics.force_records import GONE, NEW, READING

DEVICE = np.dtype(
    [
        ("id", np.int64),
        ("position_m", np.float64, (3,)),
        ("frame", np.float64, (3, 3)),
        ("count", np.int64),
    ],
    align=True,
)
"""A device of the library: its number, what it measured last, how often."""

MM_PER_M = 1e3


class Linked(NamedTuple):
    """The two functions of a force device, kept alive, and their addresses."""

    read: Any
    command: Any
    read_address: int
    command_address: int


def linked() -> Linked:
    """Compile the two functions that `devices.haptics.force_port` asks for.

    To be called once the library's symbols are there: a missing one ends the process.
    """
    device_at: Any = types.CPointer(from_dtype(DEVICE))  # type: ignore[no-untyped-call]
    reading_at: Any = types.CPointer(from_dtype(READING))  # type: ignore[no-untyped-call]
    get_pose: Any = types.ExternalFunction(
        "dhdGetPositionAndOrientationFrame",
        types.int32(types.int64, types.int64, types.int64, types.int64, types.int8),
    )
    get_buttons: Any = types.ExternalFunction(
        "dhdGetButtonMask", types.uint32(types.int8)
    )
    set_force: Any = types.ExternalFunction(
        "dhdSetForce",
        types.int32(types.float64, types.float64, types.float64, types.int8),
    )

    @cfunc(types.int32(device_at, reading_at, types.int64))
    def read_dhd(device: Any, reading: Any, now_ns: int) -> int:
        own = carray(device, (1,))[0]
        position = np.int64(own.position_m.ctypes.data)
        number = np.int8(own.id)
        status = get_pose(
            position,
            position + 8,
            position + 16,
            np.int64(own.frame.ctypes.data),
            number,
        )
        # the library says 1 where a pose came from the short time before
        if status < 0:
            return GONE
        own.count += 1
        out = carray(reading, (1,))[0]
        out.count = own.count
        out.buttons = np.int64(get_buttons(number)) & 3
        for i in range(3):
            out.position_mm[i] = MM_PER_M * own.position_m[i]
            for j in range(3):
                out.rotation[i, j] = own.frame[i, j]
        return NEW

    @cfunc(
        types.int32(device_at, types.float64, types.float64, types.float64, types.int64)
    )
    def command_dhd(
        device: Any, x_n: float, y_n: float, z_n: float, now_ns: int
    ) -> int:
        # a saturated motor is no error
        status = set_force(x_n, y_n, z_n, np.int8(carray(device, (1,))[0].id))
        return GONE if status < 0 else 0

    return Linked(
        read_dhd, command_dhd, read_dhd.address or 0, command_dhd.address or 0
    )
