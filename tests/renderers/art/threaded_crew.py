"""Threads that pass for ranks of one machine."""

import threading
from collections.abc import Callable
from typing import TypeVar

from renderers.art.crew import MachineCrew

RANKS = 3

T = TypeVar("T")


class Threads:
    """What one of several threads needs to pass for a rank."""

    said = ""

    def __init__(self, rank: int, barrier: threading.Barrier) -> None:
        self.rank, self.ranks, self._barrier = rank, RANKS, barrier
        self.votes: list[bool] = []

    def meet(self) -> None:
        self._barrier.wait(20.0)

    def hear(self, text: str) -> str:
        if self.rank == 0:
            Threads.said = text
        self.meet()
        heard = Threads.said
        self.meet()
        return heard

    def agree(self, yes: bool) -> bool:
        self.votes.append(yes)
        return yes


def together(work: Callable[[MachineCrew], T]) -> list[T]:
    """Return what each rank finds."""
    barrier = threading.Barrier(RANKS)
    found: dict[int, T] = {}

    def run(rank: int) -> None:
        found[rank] = work(MachineCrew(Threads(rank, barrier)))

    threads = [threading.Thread(target=run, args=(n,)) for n in range(RANKS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return [found[n] for n in range(RANKS)]
