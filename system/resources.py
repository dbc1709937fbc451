"""How many processors and how much memory this process may use."""

import os
import sys


def usable_cores() -> int:
    """Return the number of processors that this process may run on."""
    # Linux alone says; a container is often given fewer than there are
    asked = getattr(os, "sched_getaffinity", None)
    return len(asked(0)) if asked is not None else os.cpu_count() or 1


def memory_bytes() -> int:
    """Return the bytes of memory of this machine."""
    if sys.platform == "win32":
        import psutil

        return int(psutil.virtual_memory().total)
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
