"""A recording as a live device, at exactly the speed it was made at."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from devices.port import Clock
from devices.pose import Pose
from devices.source import PulledSource
from system import UserError


class RecordedArm(PulledSource):
    """Play recorded poses as an arm would give them; see ``QueuedSource``.

    Every pose comes back bit for bit, its ``time_s`` included; only ``host_time_s`` is
    new: the moment at which it was due. Due moments are counted from the start, not
    from pose to pose, so that no error adds up. Where the recording pauses, so does
    the playback. After the last pose ``read`` raises EOFError.
    """

    def __init__(
        self,
        poses: Sequence[Pose],
        *,
        name: str = "the recording",
        clock: Clock | None = None,
    ) -> None:
        """Begin to play.

        Raise UserError when there is no pose, or when one is not later than the
        one before it.
        """
        super().__init__(name, clock)
        if not poses:
            raise UserError(f"{name} holds no pose; there is nothing to play")
        self._poses = tuple(poses)
        self._times = np.array([pose.time_s for pose in self._poses])
        steps = np.diff(self._times)
        if (steps <= 0.0).any():
            wrong = int(np.argmax(steps <= 0.0))
            raise UserError(
                f"{name} must run forwards, but pose {wrong + 1} at "
                f"{self._times[wrong + 1]:g} s follows pose {wrong} at "
                f"{self._times[wrong]:g} s"
            )
        self._next = 0
        self._began_s = self._clock.now()

    def _due_s(self) -> float:
        if self._is_over():
            return math.inf
        return self._began_s + float(self._times[self._next] - self._times[0])

    def _make(self, due_s: float) -> Pose:
        pose = self._poses[self._next]
        self._next += 1
        return replace(pose, host_time_s=due_s)

    def _is_over(self) -> bool:
        return self._next == len(self._poses)
