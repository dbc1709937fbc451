"""Poses on their way from the thread that measures to whoever wants them."""

import threading
import time
from collections.abc import Callable, Sequence
from queue import Empty, SimpleQueue

from devices.port import DeviceError, DeviceReason
from devices.pose import Pose

# Almost three minutes at 100 Hz: a consumer further behind is not going to catch up.
LARGEST_QUEUE = 1 << 14


def _silence(timeout_s: float) -> str:
    return f"No pose came within {timeout_s:g} seconds."


class PoseQueue:
    """Every pose once and in order, or the newest; the two do not disturb each other.

    ``refuse`` raises when no pose can be expected, ``over`` says so for those who
    wait; ``silence`` tells why none came within some seconds.
    """

    def __init__(
        self,
        refuse: Callable[[], None],
        over: Callable[[], bool],
        silence: Callable[[float], str] = _silence,
    ) -> None:
        self.newest: Pose | None = None
        self._refuse = refuse
        self._over = over
        self._silence = silence
        # Compiled: a condition with a list beside it costs the thread that measures
        # four times as much for each pose that somebody waits for.
        self._items: SimpleQueue[Pose | None] = SimpleQueue()
        """None wakes who waits to look around."""
        self._waiting: set[int] = set()
        # Counted by one thread each.
        self._lost = self._confessed = 0
        self._loss: DeviceError | None = None

    @property
    def is_awaited(self) -> bool:
        """Get whether somebody waits for the very next pose."""
        return bool(self._waiting)

    def put(self, poses: Sequence[Pose]) -> None:
        """Add poses and wake who waits."""
        items = self._items
        for pose in poses:
            if items.qsize() >= LARGEST_QUEUE:
                self._lost += self._next() is not None
            self.newest = pose
            items.put(pose)

    def tell(self, loss: DeviceError) -> None:
        """Let a reader know of a loss that may pass, once, behind earlier poses."""
        self._loss = loss
        self.wake()

    def wake(self) -> None:
        """Let those who wait see whether it is over."""
        self._items.put(None)

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise TimeoutError or what ``refuse`` raises."""
        self._confess()
        pose = self._next()
        if pose is None:
            pose = self._wait(timeout_s)
        if pose is None:
            self._tell_or_refuse()
            raise TimeoutError(self._silence(timeout_s))
        return pose

    def drain(self) -> list[Pose]:
        """Return every pose that is waiting, oldest first; raise as ``read`` does."""
        self._confess()
        poses = list(iter(self._next, None))
        if not poses:
            self._tell_or_refuse()
        return poses

    def latest(self) -> Pose | None:
        """Return the newest pose; raise what ``refuse`` raises."""
        self._refuse()
        return self.newest

    def _next(self) -> Pose | None:
        """Take the next pose that is there already."""
        while True:
            try:
                item = self._items.get_nowait()
            except Empty:
                return None
            if item is not None:
                return item
            if self._over() and self._items.empty():
                # It stays for whoever else waits.
                self.wake()
                return None

    def _wait(self, timeout_s: float) -> Pose | None:
        """Wait for a pose; return None when none came or something else happened."""
        until = time.monotonic() + min(max(timeout_s, 0.0), threading.TIMEOUT_MAX)
        me = threading.get_ident()
        self._waiting.add(me)
        try:
            while not (self._loss or self._over()):
                left = max(until - time.monotonic(), 0.0)
                item = self._items.get(timeout=left)
                if item is not None:
                    return item
        except Empty:
            return None
        finally:
            self._waiting.discard(me)
        return self._next()

    def _tell_or_refuse(self) -> None:
        loss, self._loss = self._loss, None
        if loss is not None:
            raise loss
        self._refuse()

    def _confess(self) -> None:
        lost = self._lost - self._confessed
        if lost:
            self._confessed += lost
            raise DeviceError(
                DeviceReason.OVERRUN,
                f"{lost} poses were lost because nobody read them in time.",
            )
