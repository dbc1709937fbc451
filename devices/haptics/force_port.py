"""What a device that pushes back must offer, whatever it is.

A loop of 1 kHz reads and commands it from compiled code, without the interpreter. So a
device is two C functions and an address that both are given:

    int32 read(void *device, READING *reading, int64 now_ns)
    int32 command(void *device, double x_n, double y_n, double z_n, int64 now_ns)

`read` returns 1 when it wrote a new measurement, 0 when there is none and -1 when the
device is not there; `command` takes a force in the device's frame and returns 0 or -1.
`READING` is in `devices.haptics.force_records`; now_ns is the machine's clock that
`time.monotonic` tells.
Nobody calls `command` but behind `devices.haptics.kernels.guard_force`.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from devices.haptics.force_records import GUARD, SILENT
from system import UserError

SILENCE_S = 0.0015
"""A device that measured nothing for so long is pushed no more: in a loop of 1 kHz that
is the second tick without a pose, 2 ms after the last one."""

RAMP_S = 0.25
"""In which the force grows after a start or a fault."""

SHARE = 0.5
"""Of the stiffness at which a sampled wall begins to swing, so much is used."""

FASTEST_MM_S = 4000.0
"""No hand moves a tool faster: 4 mm in a tick of 1 ms."""


@dataclass(frozen=True, slots=True)
class ForceLimits:
    """What a device bears.

    force_n: the largest force. stiffness_n_m: of the stiffest wall that it holds
    without buzzing, at 1 kHz. damping_ns_m: its own; 0 where nobody knows.
    """

    force_n: float
    stiffness_n_m: float
    damping_ns_m: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no limit."""
        for name, value in (
            ("force", self.force_n),
            ("stiffness", self.stiffness_n_m),
        ):
            if not 0.0 < value < np.inf:
                raise UserError(f"a device's largest {name} must be positive: {value}")
        if not 0.0 <= self.damping_ns_m < np.inf:
            raise UserError(
                f"a device's damping is not negative, got {self.damping_ns_m}"
            )

    def stiffest_n_m(self, period_s: float) -> float:
        """Return the stiffness of the stiffest wall that a loop may make, N/m.

        period_s: of the loop. A sampled wall begins to swing at ``2 b / T`` of the
        device's own damping b (Colgate and Brown 1994); `SHARE` of that is used.
        """
        if self.damping_ns_m == 0.0:
            return self.stiffness_n_m
        return min(self.stiffness_n_m, SHARE * 2.0 * self.damping_ns_m / period_s)


class ForceDevice(Protocol):
    """Measures where its tip is and pushes it."""

    name: str
    """Under which a person knows the device."""
    limits: ForceLimits
    """What it bears."""
    read_address: int
    """Of its C function `read`."""
    command_address: int
    """Of its C function `command`."""
    state_address: int
    """What both functions are given first."""

    def close(self) -> None:
        """Let go of the device, its force zero; harmless when repeated."""
        ...


def new_guard(limits: ForceLimits, ramp_s: float = RAMP_S) -> NDArray[Any]:
    """Return a guard's record, ``(1,)`` of `GUARD`, for a device of those limits."""
    guard = np.zeros(1, GUARD)
    # nothing was heard yet
    guard["fault"] = SILENT
    guard["limit_n"] = limits.force_n
    guard["ramp_ns"] = round(ramp_s * 1e9)
    guard["silence_ns"] = round(SILENCE_S * 1e9)
    guard["speed_mm_s"] = FASTEST_MM_S
    return guard
