"""A pool of threads that share out the parts of one picture.

The calling thread works too, and each thread takes part after part from one shared
counter. A picture is a dozen maps of a millisecond and less, and a thread that sleeps
takes fifty microseconds and more to wake: those who wait look around for a while first.

What is not wanted at once is a future: one of the others does it while the rest go on
sharing out parts.
"""

import itertools
import threading
import weakref
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderers.simd.atomics import count_up, leave_and_wait, wait_for_change

Part = TypeVar("Part")
Result = TypeVar("Result")

LOOKS = 12000
"""Times that a thread looks around before it sleeps: some tenths of a millisecond."""

NAP_S = 1.0
"""After which who sleeps looks up: a pool that ends may not be able to wake them."""


class Run(Protocol):
    """Promise something like `map`, which may use threads."""

    def __call__(
        self, work: Callable[[Part], Result], parts: Sequence[Part], /
    ) -> Iterable[Result]:
        """Return what the work gives for each part, in their order."""
        ...


class Future(Generic[Result]):
    """One piece of work that is done beside the rest; ask for its result once."""

    def __init__(self, work: Callable[[], Result], board: "_Board") -> None:
        self._board = board
        self.work: Callable[[], Result] | None = work
        """What is to be done; None once somebody has begun."""
        self._done: NDArray[np.int64] = np.zeros(1, np.int64)
        self._results: list[Result] = []
        self._error: BaseException | None = None

    def result(self) -> Result:
        """Wait for the result; its error is raised. Not begun, it is done here."""
        self.help()
        while not self._done[0]:
            self._board.wait(self._done, 0)
        if self._error is not None:
            raise self._error
        return self._results[0]

    def help(self) -> None:
        """Do it here unless somebody has begun; errors are left to `result`."""
        work = self._board.claim(self)
        if work is None:
            return
        try:
            self._results.append(work())
        except BaseException as error:
            self._error = error
        self._board.tell(self._done)


class ThreadPool:
    """Run work on `threads` threads, the caller's among them.

    Raises ValueError for a count below one.
    """

    def __init__(self, threads: int) -> None:
        if threads < 1:
            raise ValueError(f"rendering needs at least one thread, got {threads}")
        self.threads = threads
        self._board = _Board()
        self._helpers: list[threading.Thread] = []
        self._in_use = threading.Lock()
        self._starting = threading.Lock()
        weakref.finalize(self, self._board.end)

    @classmethod
    def of(cls, threads: "int | ThreadPool") -> "ThreadPool":
        """Return a pool of so many threads, or the pool itself."""
        return threads if isinstance(threads, ThreadPool) else cls(threads)

    @property
    def busy(self) -> NDArray[np.int64]:
        """Return how many of the others are at work."""
        return self._board.busy

    def map(
        self, work: Callable[[Part], Result], parts: Sequence[Part]
    ) -> list[Result]:
        """Return `work(part)` of all parts in their order; the first error is raised.

        Where the pool is at work already, or closed, the caller works alone.
        """
        results: dict[int, Result] = {}
        errors: list[BaseException] = []
        turns = itertools.count()

        def take() -> None:
            # one step of a built-in counter is atomic
            while not errors and (turn := next(turns)) < len(parts):
                try:
                    results[turn] = work(parts[turn])
                except BaseException as error:
                    errors.append(error)

        is_alone = self.threads == 1 or len(parts) < 2
        if is_alone or not self._in_use.acquire(blocking=False):
            take()
        else:
            try:
                self._start()
                self._board.put_up(take)
                take()
            finally:
                self._end_map()
        if errors:
            raise errors[0]
        return [results[turn] for turn in range(len(parts))]

    def start(self, work: Callable[[], Result]) -> Future[Result]:
        """Have one of the others do `work` while the caller goes on.

        They join in maps again when it is done. In a pool of one the caller does it
        here; in a closed pool, when the result is asked for.
        """
        future = self.future(work)
        if self.threads == 1:
            future.help()
        else:
            self._start()
            self._board.hang_up(future)
        return future

    def future(self, work: Callable[[], Result]) -> Future[Result]:
        """Return a future that nobody is called for: who comes by first does it."""
        return Future(work, self._board)

    def rouse(self) -> None:
        """Tell those who sleep that a map is a tenth of a millisecond away.

        To wake takes them as long, and they look around for some time after it.
        """
        if self.threads > 1:
            self._start()
            self._board.rouse()

    def close(self) -> None:
        """End the threads."""
        self._board.end()
        for helper in self._helpers:
            helper.join()

    def _start(self) -> None:
        with self._starting:
            while len(self._helpers) < self.threads - 1:
                # the board and not the pool: a thread would keep that alive
                helper = threading.Thread(
                    target=self._board.serve, name="pool", daemon=True
                )
                helper.start()
                self._helpers.append(helper)

    def _end_map(self) -> None:
        try:
            self._board.take_down()
        except BaseException:
            # interrupted, while others still write to what the next map may be given
            self._board.take_down()
            raise
        finally:
            self._in_use.release()


class _Board:
    """What the threads of a pool tell each other.

    calls: how often something was put up. busy: helpers that have begun and not ended.
    """

    def __init__(self) -> None:
        self.calls: NDArray[np.int64] = np.zeros(1, np.int64)
        self.busy: NDArray[np.int64] = np.zeros(1, np.int64)
        self._changed = threading.Condition(threading.Lock())
        self._sleeping = 0
        self._work: Callable[[], None] | None = None
        self._futures: deque[Future[Any]] = deque()
        self.is_ended = False

    def put_up(self, work: Callable[[], None]) -> None:
        """Give the helpers work."""
        with self._changed:
            self._work = work
            self._call()

    def rouse(self) -> None:
        """Wake who sleeps, to no work."""
        with self._changed:
            if self._sleeping:
                self._call()

    def take_down(self) -> None:
        """Let nobody begin the work any more, and wait for those who have."""
        with self._changed:
            self._work = None
            busy = int(self.busy[0])
        while busy:
            self.wait(self.busy, busy)
            busy = int(self.busy[0])

    def hang_up(self, future: Future[Any]) -> None:
        """Leave a future to the next helper who is free."""
        with self._changed:
            self._futures.append(future)
            self._call()

    def claim(self, future: Future[Result]) -> Callable[[], Result] | None:
        """Take what is to be done from one who has not begun it; None is too late."""
        with self._changed:
            work, future.work = future.work, None
            if future in self._futures:
                self._futures.remove(future)
        return work

    def end(self) -> None:
        """Send the helpers home.

        A pool that nobody holds any more is ended by whatever thread its memory is
        freed in, and that may be one that has the lock: it must not be waited for.
        """
        self.is_ended = True
        count_up(self.calls)
        if self._changed.acquire(blocking=False):
            self._changed.notify_all()
            self._changed.release()

    def serve(self) -> None:
        """Help with whatever is put up until the end."""
        answered = 0
        while True:
            work = None
            with self._changed:
                calls = int(self.calls[0])
                # after the calls were read: an end that comes later is one more
                if self.is_ended:
                    return
                future = self._futures.popleft() if self._futures else None
                if future is None and answered != calls:
                    answered = calls
                    work = self._work
                    if work is not None:
                        count_up(self.busy)
            if future is not None:
                future.help()
            elif work is not None:
                work()
                # told in compiled code: who waits for it finds the interpreter's lock
                # free. Who has fallen asleep meanwhile is woken after that
                looks = 0 if self._sleeping else LOOKS
                leave_and_wait(self.busy, self.calls, calls, looks)
                with self._changed:
                    self._wake()
            else:
                self.wait(self.calls, calls)
            # nothing of the picture is kept until the next
            future = work = None

    def tell(self, done: NDArray[np.int64]) -> None:
        """Set the number to one for those who wait for it."""
        with self._changed:
            done[0] = 1
            self._wake()

    def wait(self, shared: NDArray[np.int64], value: int) -> None:
        """Wait until the number is another: first awake, then asleep."""
        if wait_for_change(shared, value, LOOKS):
            return
        with self._changed:
            self._sleeping += 1
            try:
                while shared[0] == value:
                    self._changed.wait(NAP_S)
            finally:
                self._sleeping -= 1

    def _call(self) -> None:
        count_up(self.calls)
        self._wake()

    def _wake(self) -> None:
        if self._sleeping:
            self._changed.notify_all()
