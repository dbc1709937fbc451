"""What every live input of the trainer offers: an arm, a hand, a recording, a peer."""

import math
import threading
from abc import abstractmethod
from collections.abc import Iterator

from devices.port import Clock, Closing, HostClock
from devices.pose import Pose
from devices.pose_queue import PoseQueue

SLICE_S = 0.02
"""Longest sleep at a stretch: a source may be closed or changed meanwhile."""


class QueuedSource(Closing):
    """Poses in the order in which they are measured, whether anybody reads or not.

    ``read``, iteration and ``drain`` give every pose once and in order; ``latest``
    gives the newest for a live picture. The two do not disturb one another.
    """

    _queue: PoseQueue
    _clock: Clock = HostClock()
    _silence_s = math.inf
    """How long an iteration waits for the next pose."""

    def _look(self) -> None:
        """Bring the queue up to date, where no thread does."""

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose, none lost.

        Raise TimeoutError when none came in time, EOFError when no more will come and
        DeviceError when the device failed or more than 16384 poses were left unread.
        Poses measured before a failure come first.
        """
        return self._queue.read(timeout_s)

    def drain(self) -> list[Pose]:
        """Return every pose that is waiting, oldest first; raise as ``read`` does."""
        self._look()
        return self._queue.drain()

    def latest(self) -> Pose | None:
        """Return the newest pose, None before the first; raise if the device failed."""
        self._look()
        return self._queue.latest()

    def pose_age_s(self) -> float:
        """Return seconds since the newest pose arrived or was due, inf before it."""
        self._look()
        return self._clock.now() - self._queue.newest_s()

    def __iter__(self) -> Iterator[Pose]:
        """Iterate over poses until the source ends; raise if it fails."""
        try:
            while True:
                yield self.read(self._silence_s)
        except EOFError:
            return


class PulledSource(QueuedSource):
    """A live source without a thread: its poses are worked out when they are asked for.

    Each pose belongs to its due moment, however late it is asked for, so what is read
    does not depend on when it is read.
    """

    def __init__(self, name: str, clock: Clock | None = None) -> None:
        self._name = name
        self._clock = clock or HostClock()
        self._queue = PoseQueue(name)
        self._is_closed = False
        # Callers may steer a source from another thread than the one that reads.
        self._lock = threading.RLock()

    @abstractmethod
    def _due_s(self) -> float:
        """Return the host time of the next pose; inf when none is coming for now."""

    @abstractmethod
    def _make(self, due_s: float) -> Pose:
        """Work out the pose that is due at that host time and go on to the next."""

    def _is_over(self) -> bool:
        """Return whether no pose will come any more."""
        return False

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise as ``QueuedSource.read`` does."""
        now = self._clock.now()
        until = now + timeout_s
        while True:
            due = self._advance(now)
            try:
                return self._queue.read(0.0)
            except TimeoutError:
                self._refuse_when_over()
            if now >= until:
                raise TimeoutError(
                    f"no pose came from {self._name} within {timeout_s:g} s"
                )
            self._clock.sleep(min(min(due, until) - now, SLICE_S))
            now = self._clock.now()

    def drain(self) -> list[Pose]:
        """Return every pose that is waiting, oldest first; raise as ``read`` does."""
        poses = super().drain()
        if not poses:
            self._refuse_when_over()
        return poses

    def _look(self) -> None:
        self._advance(self._clock.now())

    def close(self) -> None:
        """End the source; harmless when repeated."""
        with self._lock:
            self._is_closed = True
            self._queue.end()

    def _advance(self, now_s: float) -> float:
        """Queue all poses due by now; return when the next one is due."""
        with self._lock:
            if self._is_closed:
                return math.inf
            while (due := self._due_s()) <= now_s:
                self._queue.put((self._make(due),))
            return due

    def _refuse_when_over(self) -> None:
        if self._is_over():
            raise EOFError(f"{self._name} has come to its end")
