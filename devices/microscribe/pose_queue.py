"""Poses on their way from the thread that measures to whoever wants them."""

import threading
from collections import deque
from collections.abc import Callable, Sequence

from devices.port import DeviceError, DeviceReason
from devices.pose import Pose

# Almost three minutes at 100 Hz: a consumer further behind is not going to catch up.
LARGEST_QUEUE = 1 << 14


class PoseQueue:
    """Every pose once and in order, or the newest; the two do not disturb each other.

    ``refuse`` raises when no pose can be expected, ``over`` says so for those who
    wait.
    """

    def __init__(self, refuse: Callable[[], None], over: Callable[[], bool]) -> None:
        self.changed = threading.Condition()
        self.newest: Pose | None = None
        self.awaited = 0
        """How many wait for the next pose."""
        self._refuse = refuse
        self._over = over
        self._poses: deque[Pose] = deque()
        self._lost = 0
        self._loss: DeviceError | None = None

    def put(self, poses: Sequence[Pose]) -> None:
        """Add poses and wake who waits."""
        with self.changed:
            for pose in poses:
                if len(self._poses) == LARGEST_QUEUE:
                    self._poses.popleft()
                    self._lost += 1
                self._poses.append(pose)
            if poses:
                self.newest = poses[-1]
            self.changed.notify_all()

    def tell(self, loss: DeviceError) -> None:
        """Let a reader know of a loss that may pass, once, behind earlier poses."""
        with self.changed:
            self._loss = loss
            self.changed.notify_all()

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise TimeoutError or what ``refuse`` raises."""
        with self.changed:
            self._confess()
            if not self._poses:
                self.awaited += 1
                self.changed.wait_for(
                    lambda: self._poses or self._loss or self._over(), timeout_s
                )
                self.awaited -= 1
            if self._poses:
                return self._poses.popleft()
            self._tell_or_refuse()
        raise TimeoutError(f"no pose came within {timeout_s:g} s")

    def drain(self) -> list[Pose]:
        """Return every pose that is waiting, oldest first; raise as ``read`` does."""
        with self.changed:
            self._confess()
            if not self._poses:
                self._tell_or_refuse()
            poses = list(self._poses)
            self._poses.clear()
            return poses

    def latest(self) -> Pose | None:
        """Return the newest pose; raise what ``refuse`` raises."""
        with self.changed:
            self._refuse()
            return self.newest

    def _tell_or_refuse(self) -> None:
        if self._loss is not None:
            loss, self._loss = self._loss, None
            raise loss
        self._refuse()

    def _confess(self) -> None:
        if self._lost:
            lost, self._lost = self._lost, 0
            raise DeviceError(
                DeviceReason.OVERRUN,
                f"{lost} poses were lost because nobody read them in time.",
            )
