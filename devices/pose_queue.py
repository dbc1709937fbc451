"""Poses on their way from the thread that measures to whoever wants them."""

import math
import threading
import time
from collections.abc import Callable, Sequence
from queue import Empty, SimpleQueue

from devices.port import DeviceError, DeviceReason
from devices.pose import Pose

# Almost three minutes at 100 Hz: a consumer further behind is not going to catch up.
LARGEST_QUEUE = 1 << 14


class PoseQueue:
    """Every pose once and in order, or the newest; the two do not disturb each other.

    Bounded: when nobody reads, the oldest are lost and the next ``read`` says so.
    ``refuse`` raises when the device cannot give poses for now; ``silence`` tells why
    none came within some seconds.
    """

    def __init__(
        self,
        name: str,
        refuse: Callable[[], None] = lambda: None,
        silence: Callable[[float], str] | None = None,
    ) -> None:
        self.newest: Pose | None = None
        self._name = name
        self._refuse_for_now = refuse
        self._silence = silence or self._nothing_came
        self._error: Exception | None = None
        self._ended = False
        # Compiled: a condition with a list beside it costs the thread that measures
        # four times as much for each pose that somebody waits for.
        self._items: SimpleQueue[Pose | None] = SimpleQueue()
        """None wakes who waits to look around."""
        self._waiting: set[int] = set()
        # Counted by one thread each.
        self._lost = self._confessed = 0
        self._loss: DeviceError | None = None
        # since when a reader has waited in vain
        self._vain_s: float | None = None

    @property
    def is_awaited(self) -> bool:
        """Return whether somebody waits for the very next pose."""
        return bool(self._waiting)

    @property
    def is_over(self) -> bool:
        """Return whether no more poses will come."""
        return self._error is not None or self._ended

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
        self._wake()

    def fail(self, error: Exception) -> None:
        """Let readers raise ``error`` once they have read what came before it."""
        self._error = error
        self._wake()

    def end(self) -> None:
        """Let readers raise EOFError once they have read what came before."""
        self._ended = True
        self._wake()

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise as ``QueuedSource.read`` does."""
        self._confess()
        if self._vain_s is None:
            self._vain_s = time.monotonic()
        pose = self._next()
        if pose is None:
            pose = self._wait(timeout_s)
        if pose is None:
            since_s, self._vain_s = self._vain_s, None
            # who is told of a loss begins to wait anew
            self._tell_or_refuse()
            self._vain_s = since_s
            # who waits in slices is told of the whole wait
            waited_s = max(time.monotonic() - since_s, timeout_s)
            raise TimeoutError(self._silence(round(waited_s, 2)))
        self._vain_s = None
        return pose

    def drain(self) -> list[Pose]:
        """Return every pose that is waiting, oldest first; raise as ``read`` does."""
        self._confess()
        poses = list(iter(self._next, None))
        if not poses:
            self._tell_or_refuse()
        return poses

    def latest(self) -> Pose | None:
        """Return the newest pose, None before the first; raise if the device failed."""
        self.refuse()
        return self.newest

    def newest_s(self) -> float:
        """Return the host time of the newest pose, -inf before the first."""
        newest = self.newest
        return -math.inf if newest is None else newest.host_time_s

    def refuse(self) -> None:
        """Raise when no pose can be expected."""
        if self._error is not None:
            raise self._error
        if self._ended:
            raise EOFError(f"{self._name} was closed")
        self._refuse_for_now()

    def _nothing_came(self, timeout_s: float) -> str:
        return f"no pose came from {self._name} within {timeout_s:g} s"

    def _wake(self) -> None:
        self._items.put(None)

    def _next(self) -> Pose | None:
        """Take the next pose that is there already."""
        while True:
            try:
                item = self._items.get_nowait()
            except Empty:
                return None
            if item is not None:
                return item
            if self.is_over and self._items.empty():
                # It stays for whoever else waits.
                self._wake()
                return None

    def _wait(self, timeout_s: float) -> Pose | None:
        """Wait for a pose; return None when none came or something else happened."""
        until = time.monotonic() + min(max(timeout_s, 0.0), threading.TIMEOUT_MAX)
        me = threading.get_ident()
        self._waiting.add(me)
        try:
            while not (self._loss or self.is_over):
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
        self.refuse()

    def _confess(self) -> None:
        lost = self._lost - self._confessed
        if lost:
            self._confessed += lost
            raise DeviceError(
                DeviceReason.OVERRUN,
                f"{lost} poses were lost because nobody read them in time.",
            )
