"""Rows of a picture shared out over threads."""

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


class RowBands:
    """Run a kernel over bands of rows on a fixed number of threads.

    Kernels must release the interpreter lock and give each row a value that does not
    depend on the band it is in; then any number of threads gives the same bits.
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
        self._pool = (
            ThreadPoolExecutor(threads, thread_name_prefix="rows")
            if threads > 1
            else None
        )

    def run(self, rows: int, kernel: Callable[[int, int], None]) -> None:
        """Call ``kernel(first, past_last)`` so that every row is covered once."""
        if self._pool is None:
            kernel(0, rows)
            return
        edges = [rows * i // self._bands for i in range(self._bands + 1)]
        futures = [
            self._pool.submit(kernel, first, last)
            for first, last in itertools.pairwise(edges)
            if last > first
        ]
        for future in futures:
            future.result()

    def close(self) -> None:
        """Let the threads end; the object cannot run afterwards if it had several."""
        if self._pool is not None:
            self._pool.shutdown()
