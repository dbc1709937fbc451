"""A team of threads that share out the parts of one picture.

The calling thread works too, and each thread takes part after part from one shared
counter. A picture has about fifty parts; a future for each of them cost it several
milliseconds of processor time.
"""

import itertools
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")


class ThreadTeam:
    """Run work on `threads` threads, the caller's among them.

    Raises ValueError for a count below one.
    """

    def __init__(self, threads: int) -> None:
        if threads < 1:
            raise ValueError(f"rendering needs at least one thread, got {threads}")
        self.threads = threads
        # a pool of no threads cannot be made; one that is not used starts none
        self._others = ThreadPoolExecutor(
            max(threads - 1, 1), thread_name_prefix="team"
        )

    def map(
        self, work: Callable[[Part], Result], parts: Sequence[Part]
    ) -> list[Result]:
        """Give `work(part)` of all parts in their order; the first error is raised."""
        results: dict[int, Result] = {}
        turns = itertools.count()

        def take() -> None:
            # one step of a built-in counter is atomic
            while (turn := next(turns)) < len(parts):
                results[turn] = work(parts[turn])

        helpers = min(self.threads, len(parts)) - 1
        futures = [self._others.submit(take) for _ in range(helpers)]
        try:
            take()
        finally:
            for future in futures:
                future.result()
        return [results[turn] for turn in range(len(parts))]

    def close(self) -> None:
        """End the threads."""
        self._others.shutdown()
