"""Rows of a picture shared out over threads."""

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


class RowBands:
    """Run a kernel over bands of rows on a fixed number of threads.

    The calling thread works too, and each thread takes band after band from one shared
    counter. Kernels must release the interpreter lock and give each row a value that
    does not depend on the band it is in; then any number of threads gives the same
    bits.
    """

    def __init__(self, threads: int, bands_per_thread: int = 4) -> None:
        if threads < 1 or bands_per_thread < 1:
            raise ValueError(
                f"threads and bands must be positive, got {threads}, {bands_per_thread}"
            )
        self.threads = threads
        # several bands a thread: rows at the top and bottom of a round picture are
        # short, so equal shares of rows are not equal shares of work
        self._bands = 1 if threads == 1 else threads * bands_per_thread
        self._others = (
            ThreadPoolExecutor(threads - 1, thread_name_prefix="rows")
            if threads > 1
            else None
        )

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
        if self._others is None or bands == 1:
            kernel(0, rows)
            return
        edges = [rows * i // bands for i in range(bands + 1)]
        turns = itertools.count()

        def take() -> None:
            # one step of a built-in counter is atomic
            while (turn := next(turns)) < bands:
                kernel(edges[turn], edges[turn + 1])

        helpers = min(self.threads, bands) - 1
        futures = [self._others.submit(take) for _ in range(helpers)]
        try:
            take()
        finally:
            for future in futures:
                future.result()

    def close(self) -> None:
        """Let the threads end; the object cannot run afterwards if it had several."""
        if self._others is not None:
            self._others.shutdown()
