"""Poses of an arm that must not lose its power on the way."""

import time
from dataclasses import dataclass
from typing import Protocol

from devices import DeviceError, DeviceReason, Pose
from devices.microscribe.driver.sampler import HomeState

SLICE_S = 0.5
"""An arm without power is noticed after that long."""


class HomedArm(Protocol):
    """What is asked of an arm; `MicroScribe` has it."""

    @property
    def home_state(self) -> HomeState:
        """Get whether its angle registers can be trusted."""
        ...

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose."""
        ...


@dataclass(frozen=True, slots=True)
class HomedPoses:
    """Pass an arm's poses on; end at once when its angles cannot be trusted any more.

    An arm that was without power has other angles in the same place, and its driver
    gives no pose until it is homed: waiting brings nothing.
    """

    arm: HomedArm

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise DeviceError(NOT_HOMED) after a loss of power."""
        until = time.monotonic() + timeout_s
        while True:
            left = until - time.monotonic()
            try:
                return self.arm.read(max(min(left, SLICE_S), 0.0))
            except TimeoutError:
                if self.arm.home_state is HomeState.UNKNOWN:
                    raise DeviceError(
                        DeviceReason.NOT_HOMED,
                        "The arm was without power, and what was measured before no "
                        "longer holds; put it into its rest, switch it off and on and "
                        "begin again.",
                    ) from None
                if left <= SLICE_S:
                    raise
