"""Faults of a line, by name and moment.

A fault is written ``NAME@START`` or ``NAME@START+DURATION`` in seconds of the
emulator's script, which begins with the first poll. A new fault is a class with a
``spoil`` method and a row in ``FAULTS``.
"""

import random
import re
from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that happens to the line for a while."""

    start_s: float
    duration_s: float = float("inf")

    unplugs: ClassVar[bool] = False
    """Whether the port itself goes away."""

    def active(self, script_s: float) -> bool:
        """Return whether the fault lasts at this moment."""
        return self.start_s <= script_s < self.start_s + self.duration_s

    def spoil(self, data: bytes, noise: random.Random) -> bytes:
        """Return what the client hears of ``data``."""
        return data


@dataclass(frozen=True, slots=True)
class Garbage(Fault):
    """Every answer becomes random bytes of about its length."""

    def spoil(self, data: bytes, noise: random.Random) -> bytes:
        """Return random bytes."""
        return noise.randbytes(len(data) + noise.randrange(3)) if data else data


@dataclass(frozen=True, slots=True)
class Mute(Fault):
    """The arm's answers do not arrive."""

    def spoil(self, data: bytes, noise: random.Random) -> bytes:
        """Return nothing."""
        return b""


@dataclass(frozen=True, slots=True)
class Unplug(Fault):
    """The port vanishes."""

    unplugs: ClassVar[bool] = True


FAULTS: dict[str, type[Fault]] = {
    "garbage": Garbage,
    "mute": Mute,
    "unplug": Unplug,
}

_FORM = re.compile(r"(?P<name>\w+)@(?P<start>[\d.]+)(\+(?P<duration>[\d.]+))?")


def parse_fault(text: str) -> Fault:
    """Read ``NAME@START[+DURATION]``; raise ValueError that lists the names."""
    match = _FORM.fullmatch(text)
    if match is None or match["name"] not in FAULTS:
        raise ValueError(
            f"fault must be NAME@SECONDS[+SECONDS] with NAME one of "
            f"{', '.join(sorted(FAULTS))}, got {text!r}"
        )
    kind = FAULTS[match["name"]]
    duration = match["duration"]
    return kind(float(match["start"]), float(duration) if duration else float("inf"))
