"""How much memory one thing may ask for."""

from system import memory_bytes

MEMORY_SHARE = 0.5
"""Of the machine's memory that one volume, or what is drawn with, may take."""


def memory_limit(processes: int = 1) -> int:
    """Return the bytes that one volume, or what is drawn with, may take.

    processes: of this machine that each draw with something of that size.
    """
    return int(MEMORY_SHARE * memory_bytes(processes))
