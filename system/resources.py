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
    # Linux alone says; a container is often given fewer than there are
    asked = getattr(os, "sched_getaffinity", None)
    return len(asked(0)) if asked is not None else os.cpu_count() or 1


def memory_bytes() -> int:
    """Return the bytes of memory that this process may use, of this machine's.

    Less where a control group, as of a container or a cluster's job, or a limit of the
    process says so.
    """
    if sys.platform == "win32":
        import psutil

        return int(psutil.virtual_memory().total)
    import resource

    machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    found = [machine, *_group_limits(GROUPS)]
    for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA):
        most, _ = resource.getrlimit(kind)
        if most != resource.RLIM_INFINITY:
            found.append(most)
    return min(found)


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
