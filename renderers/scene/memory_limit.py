"""How much memory one thing may ask for."""

import os

MEMORY_SHARE = 0.5
"""Of the machine's memory that one volume, or what is drawn with, may take."""


def machine_memory() -> int:
    """Return the bytes of memory of this machine."""
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def memory_limit() -> int:
    """Return the bytes that one volume, or what is drawn with, may take."""
    return int(MEMORY_SHARE * machine_memory())
