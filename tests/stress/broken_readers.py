"""Readers that fail as readers must not, for the test of what looks for that."""

from collections.abc import Callable

READERS: dict[str, Callable[..., object]] = {}

_kept: list[bytearray] = []


def raising(data: bytes) -> object:
    """Raise what nobody is told in a sentence."""
    if data[:1] > b"\x80":
        raise KeyError("a")
    return data


def hanging(data: bytes) -> object:
    """Never come to an end."""
    while data[:1] > b"\x80":
        pass
    return data


def growing(data: bytes) -> object:
    """Keep ever more memory."""
    if data[:1] > b"\x80":
        _kept.append(bytearray(b"a" * (256 << 20)))
    return data


STREAMS = {
    "raising": (b"\0", raising),
    "hanging": (b"\0", hanging),
    "growing": (b"\0", growing),
}
