"""Sources of poses that handle a lost device, the end of a flight, a loss of power."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from devices import DeviceError, DeviceReason, Pose
from devices.microscribe.driver.sampler import HomeState

SLICE_S = 0.1
"""Longest wait for a pose between two looks whether the flight was ended."""

POWER_SLICE_S = 0.5
"""An arm without power is noticed after that long."""


class OrderedPoses(Protocol):
    """Poses in the order in which they were measured."""

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; TimeoutError when none comes in time."""
        ...


class EndedError(Exception):
    """The flight was ended; a source of poses raises it."""


class ClosedError(EndedError):
    """The window was closed; the flight ends."""


class CancellableSource:
    """Pass an arm's poses on until the window closes or the trainee ends the flight."""

    def __init__(
        self,
        arm: OrderedPoses,
        closed: threading.Event,
        ended: threading.Event | None = None,
    ) -> None:
        self._arm = arm
        self._closed = closed
        self._ended = threading.Event() if ended is None else ended

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; ClosedError or EndedError once there is to be none."""
        until = time.monotonic() + timeout_s
        while True:
            if self._closed.is_set():
                raise ClosedError
            if self._ended.is_set():
                raise EndedError
            left = until - time.monotonic()
            try:
                return self._arm.read(max(min(left, SLICE_S), 0.0))
            except TimeoutError:
                if left <= SLICE_S:
                    raise


@dataclass(slots=True)
class ReconnectingSource:
    """Pass poses on; wait while the device is away, and report its loss and return.

    A driver that looks for its lost device raises the loss once and then has no poses
    for a while; one that has given up raises whenever it is read, which passes.

    Poses that nobody read in time are no loss of the device: that is told, and the next
    pose is given.

    on_loss: called with the loss. on_return: called with the device's seconds between
    the poses before and after. on_late: called with what nobody read in time.
    patience_s: the loss is raised after that time.
    """

    source: OrderedPoses
    patience_s: float = math.inf
    on_loss: Callable[[DeviceError], None] = lambda _: None
    on_return: Callable[[float], None] = lambda _: None
    on_late: Callable[[str], None] = lambda _: None
    _loss: DeviceError | None = None
    _until_s: float = math.inf
    _last_s: float | None = None
    _early: Pose | None = None
    """A pose that came before the loss was reported."""

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise TimeoutError when a present device is silent.

        While the device is away only a timeout of zero ends the wait.
        """
        while True:
            try:
                pose = self._early or self.source.read(timeout_s)
                self._early = None
            except DeviceError as error:
                if error.reason is DeviceReason.OVERRUN:
                    self.on_late(str(error))
                    continue
                if self._loss is not None:
                    raise
                self._lose(error)
                continue
            except TimeoutError:
                if self._loss is None or timeout_s <= 0.0:
                    raise
                if time.monotonic() >= self._until_s:
                    raise self._loss from None
                continue
            return self._passed(pose)

    def _lose(self, loss: DeviceError) -> None:
        """Tell of the loss; raise it when the device is not being looked for."""
        try:
            early = self.source.read(0.0)
        except TimeoutError:
            early = None
        self._loss = loss
        self._until_s = time.monotonic() + self.patience_s
        self.on_loss(loss)
        self._early = early

    def _passed(self, pose: Pose) -> Pose:
        if self._loss is not None:
            self._loss = None
            last_s = pose.time_s if self._last_s is None else self._last_s
            self.on_return(pose.time_s - last_s)
        self._last_s = pose.time_s
        return pose


class HomedArm(Protocol):
    """What is asked of an arm; `MicroScribe` has it."""

    @property
    def home_state(self) -> HomeState:
        """Return whether its angle registers can be trusted."""
        ...

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose."""
        ...


@dataclass(frozen=True, slots=True)
class HomedSource:
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
                return self.arm.read(max(min(left, POWER_SLICE_S), 0.0))
            except TimeoutError:
                if self.arm.home_state is HomeState.UNKNOWN:
                    raise DeviceError(
                        DeviceReason.NOT_HOMED,
                        "The arm was without power, and what was measured before no "
                        "longer holds; put it into its rest, switch it off and on and "
                        "begin again.",
                    ) from None
                if left <= POWER_SLICE_S:
                    raise
