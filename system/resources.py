"""How many processors and how much memory this process may use."""

import os
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

GROUPS = Path("/sys/fs/cgroup")
"""Where Linux tells of control groups, of both of its kinds."""


def usable_cores() -> int:
    """Return the number of processors that this process may run on."""
    return len(usable_processors())


def usable_processors() -> list[int]:
    """Return the numbers of the processors that this process may run on."""
    # Linux alone says; a container is often given fewer than there are
    asked = getattr(os, "sched_getaffinity", None)
    return sorted(asked(0)) if asked else list(range(os.cpu_count() or 1))


def use_processors(numbers: list[int]) -> None:
    """Let this thread, and those that it starts, run on processors, where it can."""
    set_ = getattr(os, "sched_setaffinity", None)
    if set_ is not None:
        set_(0, numbers)


def memory_bytes(processes: int = 1) -> int:
    """Return the bytes of memory that each of some processes may use.

    They share the machine's, or what a control group, as of a container or a cluster's
    job, leaves of it. A limit of the process is each one's own, and what it takes now,
    libraries and mapped files included, counts.
    """
    if sys.platform == "win32":
        import psutil

        return int(psutil.virtual_memory().total) // processes
    import resource

    machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    found = [min((machine, *_group_limits(GROUPS))) // processes]
    for kind, name in (
        (resource.RLIMIT_AS, "VmSize"),
        (resource.RLIMIT_DATA, "VmData"),
    ):
        most, _ = resource.getrlimit(kind)
        if most != resource.RLIM_INFINITY:
            found.append(max(most - _in_use(name), 0))
    return min(found)


def _in_use(name: str) -> int:
    """Return the bytes that a limit counts already, where the system tells."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return 0
    return sum(1024 * int(line.split()[1]) for line in lines if line.startswith(name))


@cache
def _group_limits(place: Path) -> tuple[int, ...]:
    """Return the limits of this process's control groups, and of those around them.

    Read once: every camera asks, and reading them takes a fifth of a millisecond.
    """
    return tuple(_read_limits(place))


def _read_limits(groups_place: Path) -> Iterator[int]:
    try:
        groups = Path("/proc/self/cgroup").read_text().splitlines()
    except OSError:
        return
    for group in groups:
        _, kinds, place = group.split(":", 2)
        if kinds and "memory" not in kinds.split(","):
            continue
        root = groups_place / "memory" if kinds else groups_place
        name = "memory.limit_in_bytes" if kinds else "memory.max"
        inner = root / place.lstrip("/")
        for folder in (inner, *inner.parents):
            try:
                yield int((folder / name).read_text())
            except (OSError, ValueError):
                continue  # this one has none
