"""Those who prepare a scene together: threads, or ranks of one machine.

Ranks of one machine keep one copy of what is large, in memory that all of them map.
That is freed when the last of them lets go of it, without a word between them.
"""

import math
import mmap
import os
import tempfile
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from renderers.scene.thread_pool import Run

T = TypeVar("T")


class Crew:
    """Threads of one process.

    is_shared: others write to what `empty` gives, too.
    """

    is_shared = False

    def __init__(self, run: Run = map) -> None:
        """Take who shares out parts."""
        self.run = run

    def empty(self, shape: int | tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return room for what all of them see."""
        return np.empty(shape, dtype)

    def share(self, work: Callable[[T], object], parts: Sequence[T]) -> None:
        """Do all parts; return when they are done. All call it alike."""
        deque(self.run(work, parts), 0)

    def once(self, work: Callable[[], object]) -> None:
        """Let one of them do it; return when it is done."""
        work()

    def agree(self, yes: bool) -> bool:
        """Return whether all say yes."""
        return yes


ALONE = Crew()


class Company(Protocol):
    """Promise what ranks of one machine need of each other."""

    rank: int
    ranks: int

    def meet(self) -> None:
        """Wait until all have come here."""
        ...

    def agree(self, yes: bool) -> bool:
        """Return whether all say yes; all together."""
        ...

    def hear(self, text: str) -> str:
        """Return what rank 0 says; all together."""
        ...


class MachineCrew(Crew):
    """Ranks of one machine; each calls everything in the same order."""

    is_shared = True

    def __init__(self, company: Company, run: Run = map) -> None:
        """Take the other ranks."""
        super().__init__(run)
        self.company = company

    def empty(self, shape: int | tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Return room in memory that all of them map: zeros, until one writes to it."""
        company, kind = self.company, np.dtype(dtype)
        size = max(math.prod(np.atleast_1d(shape)) * kind.itemsize, 1)
        first = company.rank == 0
        handle, name = _made(size) if first else (-1, "")
        name = company.hear(name)
        if not first:
            handle = os.open(name, os.O_RDWR)
        mapped = mmap.mmap(handle, size)
        company.meet()
        os.close(handle)
        if first and not name.startswith(_HANDLES):
            os.unlink(name)
        return np.frombuffer(mapped, kind, math.prod(np.atleast_1d(shape))).reshape(
            shape
        )

    def share(self, work: Callable[[T], object], parts: Sequence[T]) -> None:
        """Do this rank's parts, then wait for the others."""
        super().share(work, parts[self.company.rank :: self.company.ranks])
        self.company.meet()

    def once(self, work: Callable[[], object]) -> None:
        """Let rank 0 do it."""
        if self.company.rank == 0:
            work()
        self.company.meet()

    def agree(self, yes: bool) -> bool:
        """Ask all ranks."""
        return self.company.agree(yes)


_HANDLES = "/proc/"


def _made(size: int) -> tuple[int, str]:
    """Make memory without a file where there is such; else a file that is soon gone."""
    if hasattr(os, "memfd_create"):
        handle = os.memfd_create("paravol")
        name = f"{_HANDLES}{os.getpid()}/fd/{handle}"
    else:
        handle, name = tempfile.mkstemp(prefix="paravol-")
    os.ftruncate(handle, size)
    return handle, name
