"""Poses of a device that may be unplugged and plugged in again."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from devices import DeviceError, Pose
from paravol.flight import OrderedPoses


def _nobody(_: object) -> None:
    """Tell nobody."""


@dataclass(slots=True)
class LastingPoses:
    """Pass poses on; wait while the device is away and tell when it went and came.

    A driver that looks for its lost device raises the loss once and then has no poses
    for a while; one that has given up raises whenever it is read, which passes.

    on_loss: called with the loss. on_return: called with the device's seconds between
    the poses before and after. patience_s: the loss is raised after that time.
    """

    source: OrderedPoses
    patience_s: float = math.inf
    on_loss: Callable[[DeviceError], None] = _nobody
    on_return: Callable[[float], None] = _nobody
    _loss: DeviceError | None = None
    _until_s: float = math.inf
    _last_s: float | None = None
    _early: Pose | None = None
    """Came before its loss was told."""

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise TimeoutError when a present device is silent.

        While the device is away only a timeout of zero ends the wait.
        """
        while True:
            try:
                pose = self._early or self.source.read(timeout_s)
                self._early = None
            except DeviceError as error:
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
