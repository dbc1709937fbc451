"""How much memory one thing may ask for."""

from system import memory_bytes

MEMORY_SHARE = 0.5
"""Of the machine's memory that one volume, or what is drawn with, may take."""


def memory_limit() -> int:
    """Return the bytes that one volume, or what is drawn with, may take."""
    return int(MEMORY_SHARE * memory_bytes())
