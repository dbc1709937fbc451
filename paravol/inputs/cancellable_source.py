"""What stands between an arm and a flight that a window watches and steers."""

import threading
import time
from dataclasses import dataclass, replace

from devices import Pose
from paravol.flight import Aim, EndedError, OrderedPoses
from scenarios import Sample

SLICE_S = 0.1
"""How long a wait for a pose may keep the window from closing."""


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
class KeyboardRoll:
    """Turn the light post by hand, on top of what a channel says.

    turn_deg may be changed at any time, from any thread.
    """

    aim: Aim
    turn_deg: float = 0.0

    def complete(self, pose: Pose) -> Sample:
        """Join a pose with the channel and the hand's turn."""
        sample = self.aim.complete(pose)
        return replace(sample, roll_deg=sample.roll_deg + self.turn_deg)
