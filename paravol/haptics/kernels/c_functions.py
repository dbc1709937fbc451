"""A device's C functions as compiled code takes them: by type, their address at a call.

So one compiled loop serves every device, and its cache does not know their addresses.
"""

from typing import Any

from numba import types

READ = types.int32(types.int64, types.int64, types.int64)
"""``int32 read(void *device, READING *reading, int64 now_ns)``"""

COMMAND = types.int32(
    types.int64, types.float64, types.float64, types.float64, types.int64
)
"""``int32 command(void *device, double x_n, double y_n, double z_n, int64 now_ns)``"""


class CFunction(types.WrapperAddressProtocol):
    """Name a C function by its address and type."""

    def __init__(self, address: int, type_: Any) -> None:
        self._address = address
        self._type = type_

    def __wrapper_address__(self) -> int:
        """Return where it is."""
        return self._address

    def signature(self) -> Any:
        """Return what it takes and returns."""
        return self._type
