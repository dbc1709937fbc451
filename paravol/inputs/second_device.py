"""A second device, which moves the tool while another one moves the scope.

Each measures in its own time. Both are joined on the host's clock: to a pose of the
scope belongs the tool's newest pose that was measured by then.
"""

import math
import time
from bisect import bisect_right, insort
from collections.abc import Callable
from typing import Protocol

from devices import DeviceError, Pose
from devices.port import DeviceReason
from paravol.inputs.reach import Reach

OLDEST_S = 0.25
"""A tool whose device was silent for so long is withdrawn from view: a frozen one
would stand in tissue while the scope goes on."""

RETRY_S = 0.5
"""Between two tries to open a device that went away."""

MOST_POSES = 4096
"""Poses that wait for the scope's: forty seconds at 100 Hz."""


class PoseJoin:
    """Find the newest pose at or before a time, whatever order they come in.

    Poses are told apart by their host and device times. Times asked for must not fall.
    """

    def __init__(self) -> None:
        self._poses: list[Pose] = []

    def put(self, pose: Pose) -> None:
        """Add a pose; the oldest of too many is dropped."""
        insort(self._poses, pose, key=_when)
        if len(self._poses) > MOST_POSES:
            del self._poses[0]

    def at(self, host_time_s: float) -> Pose | None:
        """Return the newest pose of that time or before, None before the first."""
        after = bisect_right(self._poses, (host_time_s, math.inf), key=_when)
        if after == 0:
            return None
        # those before it will not be asked for any more
        del self._poses[: after - 1]
        return self._poses[0]


class DrainedPoses(Protocol):
    """A live source, as far as it is asked here."""

    def drain(self) -> list[Pose]:
        """Return every pose that is waiting; raise as `QueuedSource.read` does."""
        ...


Reopen = Callable[[], DrainedPoses | None]
"""Opens a device again that went away; None while it is not there, or for one that
looks for itself."""


class SecondDevice:
    """Where the tool is at each of the scope's poses.

    on_loss: called once with a sentence when the device is lost, on_return: with one
    when it is back. A flight goes on without it. reach: of the head that its poses are
    about; None to take all.
    """

    def __init__(
        self, source: DrainedPoses, name: str, reopen: Reopen = lambda: None
    ) -> None:
        """Take over an open source."""
        self.on_loss: Callable[[str], None] = lambda _: None
        self.on_return: Callable[[str], None] = lambda _: None
        self.reach: Reach | None = None
        self._source = source
        self._name = name
        self._reopen = reopen
        self._join = PoseJoin()
        self._is_lost = False
        self._lost_s = self._newest_s = -math.inf
        self._is_failed = False
        self._retry_s = -math.inf
        self._has_ended = False

    def at(self, host_time_s: float) -> Pose | None:
        """Return the tool's pose at a time on the host's clock.

        None before the first, and once the newest is older than `OLDEST_S`.
        """
        self._gather()
        pose = self._join.at(host_time_s)
        if pose is None:
            return None
        if host_time_s - pose.host_time_s > OLDEST_S:
            if not self._has_ended:
                text = f"{self._name} sends nothing; the tool is put away."
                self._lose(text, pose.host_time_s)
            return None
        if self._is_lost and pose.host_time_s > self._lost_s:
            self._is_lost = False
            self.on_return(f"{self._name} is back.")
        return pose

    def _gather(self) -> None:
        """Take in what was measured since; a device that fails is told of once."""
        if self._has_ended or (self._is_failed and not self._opened_again()):
            return
        try:
            self._take()
        except EOFError:
            self._has_ended = True
            self.on_loss(f"{self._name} has come to its end; the tool is put away.")
        except DeviceError as error:
            if error.reason is DeviceReason.OVERRUN:
                # nobody read while the scope was registered: only new ones count
                return
            # a source that looks for its device says so once, and gives poses later
            self._is_failed = True
            self._lose(f"{self._name}: {error}", self._newest_s)

    def _take(self) -> None:
        for pose in self._source.drain():
            if self.reach is not None and not self.reach.holds(pose):
                continue
            self._join.put(pose)
            self._newest_s = max(self._newest_s, pose.host_time_s)

    def _opened_again(self) -> bool:
        """Return whether the source may be read: the old one, or a new one."""
        now = time.monotonic()
        if now < self._retry_s:
            return False
        self._retry_s = now + RETRY_S
        try:
            found = self._reopen()
        except (DeviceError, OSError):
            return False
        if found is not None:
            self._source = found
        self._is_failed = False
        return True

    def _lose(self, text: str, last_s: float) -> None:
        """Tell of a loss once; last_s: of the last pose before it, on the host."""
        if not self._is_lost:
            self._is_lost = True
            self._lost_s = last_s
            self.on_loss(text)


def _when(pose: Pose) -> tuple[float, float]:
    return pose.host_time_s, pose.time_s
