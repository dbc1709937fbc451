"""Rows of a picture shared out over threads."""

from collections.abc import Callable
from functools import partial
from typing import TypeVar

from renderers.scene.thread_pool import Future, ThreadPool

Result = TypeVar("Result")

OWN_SHARE = 0.25
"""Of the rows that the caller of `begin` does: the others are done when it has begun
the next view and there is work for all threads again."""


class RowBands:
    """Run a kernel over bands of rows on a fixed number of threads.

    Kernels must release the interpreter lock and give each row a value that does not
    depend on the band it is in; then any number of threads gives the same bits.
    """

    def __init__(self, threads: int | ThreadPool, bands_per_thread: int = 4) -> None:
        """Take so many threads, or a pool's that others use as well."""
        if bands_per_thread < 1:
            raise ValueError(f"bands must be positive, got {bands_per_thread}")
        self._pool = ThreadPool.of(threads)
        threads = self.threads = self._pool.threads
        # several bands a thread: rows at the top and bottom of a round picture are
        # short, so equal shares of rows are not equal shares of work
        self._bands = 1 if threads == 1 else threads * bands_per_thread

    def run(
        self, rows: int, kernel: Callable[[int, int], None], least: int = 1
    ) -> None:
        """Call ``kernel(first, past_last)`` so that every row is covered once.

        least: rows of a band, where there are that many, for kernels to which a band
        of its own costs something. The first error of a band is raised.
        """
        bands = min(self._bands, rows // least)
        # as many for each thread
        bands = max(bands - bands % self.threads, 1)
        edges = [rows * i // bands for i in range(bands + 1)]

        def work(band: int) -> None:
            kernel(edges[band], edges[band + 1])

        self._pool.map(work, range(bands))

    def begin(
        self,
        rows: int,
        kernel: Callable[[int, int], None],
        then: Callable[[], Result],
    ) -> Future[Result]:
        """Leave most of the rows to one of the threads, which calls `then` at last."""
        own = round(OWN_SHARE * rows) if self.threads > 1 else 0
        upper = self._pool.future(partial(kernel, 0, own))

        def finish() -> Result:
            kernel(own, rows)
            upper.result()
            return then()

        finished = self._pool.start(finish)
        upper.help()
        return finished

    @property
    def pool(self) -> ThreadPool:
        """Return the pool that shares the rows out."""
        return self._pool

    def close(self) -> None:
        """Let the threads end; the object cannot run afterwards if it had several."""
        self._pool.close()
