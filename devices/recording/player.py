"""A recording as a live device, at exactly the speed it was made at, or another."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from devices.port import Clock
from devices.pose import Pose
from devices.source import PulledSource
from disk import UserError


class RecordedArm(PulledSource):
    """Play recorded poses as an arm would give them; see ``LiveSource``.

    Every pose comes back bit for bit, its ``time_s`` included; only ``host_time_s`` is
    new: the moment at which it was due. Due moments are counted from the start, not
    from pose to pose, so that no error adds up. Where the recording pauses, so does
    the playback. After the last pose ``read`` raises EOFError, until a ``seek``.
    """

    def __init__(
        self,
        poses: Sequence[Pose],
        *,
        speed: float = 1.0,
        is_paused: bool = False,
        name: str = "the recording",
        clock: Clock | None = None,
    ) -> None:
        """Begin to play, or wait for ``start``.

        Raises ValueError when there is no pose, or when one is not later than the
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
        self._speed = _checked(speed)
        self._is_paused = is_paused
        self._next = 0
        # The recording stood at _origin_s when the host's clock showed _anchor_s.
        self._origin_s = float(self._times[0])
        self._anchor_s = self._clock.now()

    @property
    def duration_s(self) -> float:
        """Get the recorded time from the first pose to the last."""
        return float(self._times[-1] - self._times[0])

    @property
    def position_s(self) -> float:
        """Get the recorded time that is being played, no later than the last pose."""
        with self._lock:
            return self._position_s(self._clock.now())

    @property
    def is_paused(self) -> bool:
        """Get whether the playback stands still."""
        return self._is_paused

    @property
    def speed(self) -> float:
        """Get recorded seconds per second of the clock."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        """Play at another speed from here on; ValueError unless finite and positive."""
        with self._lock:
            self._stand_at_present()
            self._speed = _checked(speed)

    def start(self) -> None:
        """Play on from where the recording stands."""
        with self._lock:
            if self._is_paused:
                self._anchor_s = self._clock.now()
                self._is_paused = False

    def pause(self) -> None:
        """Stand still; poses that were due before can still be read."""
        with self._lock:
            self._stand_at_present()
            self._is_paused = True

    def seek(self, time_s: float) -> None:
        """Go to a recorded time; poses from before that nobody read are dropped.

        The next pose is the first at ``time_s`` or later. Raises ValueError for a time
        outside the recording.
        """
        first, last = float(self._times[0]), float(self._times[-1])
        if not first <= time_s <= last:
            raise UserError(
                f"{self._name} lasts from {first:g} to {last:g} s, it cannot be played "
                f"from {time_s:g} s"
            )
        with self._lock:
            self._queue.clear()
            self._next = int(np.searchsorted(self._times, time_s, side="left"))
            self._origin_s = time_s
            self._anchor_s = self._clock.now()

    def _due_s(self) -> float:
        if self._is_paused or self._is_over():
            return math.inf
        ahead = float(self._times[self._next]) - self._origin_s
        return self._anchor_s + ahead / self._speed

    def _make(self, due_s: float) -> Pose:
        pose = self._poses[self._next]
        self._next += 1
        return replace(pose, host_time_s=due_s)

    def _is_over(self) -> bool:
        return self._next == len(self._poses)

    def _position_s(self, now_s: float) -> float:
        if self._is_paused:
            return self._origin_s
        played = (now_s - self._anchor_s) * self._speed
        return min(self._origin_s + played, float(self._times[-1]))

    def _stand_at_present(self) -> None:
        """Hand out what is due and count from this moment on."""
        now = self._clock.now()
        self._advance(now)
        self._origin_s = self._position_s(now)
        self._anchor_s = now


def _checked(speed: float) -> float:
    if not (math.isfinite(speed) and speed > 0.0):
        raise UserError(f"speed must be finite and positive, got {speed}")
    return speed
