"""The wire between an emulated arm and a client's terminal.

Bytes take the time that a UART would give them, faults are put in on the way, and a
client at another rate than the session's hears noise.
"""

import random
import struct
from collections import deque
from dataclasses import dataclass, field

from devices.microscribe.emulator_faults import Fault

# The arm thinks "just under a millisecond" before it answers.
LATENCY_S = 0.001

BITS_PER_BYTE = 10.0


@dataclass(slots=True)
class PacedOutput:
    """Bytes on their way, each chunk with the moment at which it arrives.

    The first byte of an answer comes alone and the rest with its last one: a reader
    sees the true arrival of the header without a wake-up for every byte.
    """

    fast: bool = False
    _free_s: float = 0.0
    _queue: deque[tuple[float, bytes]] = field(default_factory=deque)

    def push(self, data: bytes, baud: int, now_s: float) -> None:
        """Send ``data``, no sooner than what was pushed before."""
        if not data:
            return
        if self.fast:
            self._queue.append((now_s, data))
            return
        byte_s = BITS_PER_BYTE / baud
        start = max(self._free_s, now_s + LATENCY_S)
        self._free_s = start + len(data) * byte_s
        self._queue.append((start + byte_s, data[:1]))
        if len(data) > 1:
            self._queue.append((self._free_s, data[1:]))

    def due(self, now_s: float) -> bytes:
        """Return what has arrived by now."""
        out = bytearray()
        while self._queue and self._queue[0][0] <= now_s:
            out += self._queue.popleft()[1]
        return bytes(out)

    def next_s(self) -> float | None:
        """Return when the next bytes arrive, None if none are on their way."""
        return self._queue[0][0] if self._queue else None


@dataclass(slots=True)
class FaultyLine:
    """What the client's bytes and the arm's suffer on the wire."""

    faults: tuple[Fault, ...]
    noise: random.Random

    def unplugged(self, script_s: float | None) -> bool:
        """Return whether a fault has pulled the plug."""
        return any(f.unplugs for f in self._active(script_s))

    def to_client(self, data: bytes, script_s: float | None) -> bytes:
        """Return what the client hears of ``data``."""
        for fault in self._active(script_s):
            data = fault.spoil(data, self.noise)
        return data

    def misread(self, data: bytes) -> bytes:
        """Return what arrives of ``data`` when the two ends disagree on the rate."""
        return self.noise.randbytes(len(data))

    def _active(self, script_s: float | None) -> list[Fault]:
        if script_s is None:
            return []
        return [fault for fault in self.faults if fault.active(script_s)]


# struct termios2 of Linux: four flag words, the line discipline, 19 control
# characters, then the input and output rates as plain numbers.
_TERMIOS2 = struct.Struct("=4I20B2I")
_TCGETS2 = 0x802C542A


def client_rate(master: int) -> int | None:
    """Return the rate that the client set on its end, None where nobody can tell."""
    try:
        import fcntl

        raw = fcntl.ioctl(master, _TCGETS2, bytes(_TERMIOS2.size))
    except (ImportError, OSError):
        return None
    return int(_TERMIOS2.unpack(raw)[-1])
