"""The wire between an emulated arm and its client.

Bytes take the time that a UART would give them.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from devices.microscribe.emulator.answer import Answer, ReplyTrigger
from devices.microscribe.emulator.firmware import BITS_PER_BYTE

_FRAME = 10
_IDLE_BITS = 4


def misread(
    data: bytes, sent_rate: int, read_rate: int, keep_framing_errors: bool = False
) -> bytes:
    """Return what a UART makes of bytes that were sent at another rate.

    8 data bits, no parity, one stop bit. The sender's bits follow one another without
    a pause and the line idles high. The receiver takes a falling edge for the beginning
    of a start bit and samples the line in the middle of each of its own ten bit times.
    A byte whose stop bit reads low is a framing error: dropped, unless kept.
    """
    if sent_rate == read_rate or not data:
        return data
    line = _wire_bits(data)
    # One sender's bit lasts 2 * read_rate units, half a receiver's bit sent_rate.
    bit, half = 2 * read_rate, sent_rate

    def level(unit: int) -> int:
        at = unit // bit
        return line[at] if at < len(line) else 1

    out = bytearray()
    at = 1
    while True:
        edge = _falling_edge(line, at)
        if edge is None:
            return bytes(out)
        start = edge * bit
        if level(start + half):
            at = edge + 1
            continue
        samples = [level(start + half * (2 * i + 3)) for i in range(_FRAME - 1)]
        if samples[-1] or keep_framing_errors:
            out.append(sum(value << i for i, value in enumerate(samples[:-1])))
        # The next edge may come any time after the middle of the stop bit.
        at = -(-(start + half * (2 * _FRAME - 1)) // bit)


def _wire_bits(data: bytes) -> list[int]:
    """Return the line's level in each of the sender's bit times, least bit first."""
    bits = [1]
    for byte in data:
        bits += [0, *(byte >> i & 1 for i in range(8)), 1]
    return bits + [1] * _IDLE_BITS


def _falling_edge(line: list[int], begin: int) -> int | None:
    """Return the first bit time from ``begin`` at whose beginning the line falls."""
    for i in range(max(begin, 1), len(line)):
        if line[i] == 0 and line[i - 1] == 1:
            return i
    return None


# The rates at which an arm listens while nobody has signed on.
RATES = (9600, 14400, 19200, 28800, 38400, 57600, 115200)

# The arm thinks "just under a millisecond" before it answers.
LATENCY_S = 0.001


@dataclass(frozen=True, slots=True)
class Delivery:
    """Bytes that arrive together."""

    at_s: float
    data: bytes
    rate: int
    """Bits per second at which they were sent."""
    after: ReplyTrigger | None = None


@dataclass(slots=True)
class PacedOutput:
    """Answers on their way to the client.

    The first byte of an answer comes alone and the rest with its last one: a reader
    sees the true arrival of the header without a wake-up for every byte. ``arrival``
    may put a delivery off; order is kept.
    """

    fast: bool = False
    arrival: Callable[[float], float] = field(default=lambda at_s: at_s)
    _free_s: float = 0.0
    _arrived_s: float = 0.0
    _queue: deque[Delivery] = field(default_factory=deque)

    def push(self, answer: Answer, rate: int, now_s: float) -> None:
        """Send ``answer``, no sooner than what was pushed before."""
        data = answer.data
        thinking = 0.0 if self.fast else LATENCY_S
        byte_s = 0.0 if self.fast else BITS_PER_BYTE / rate
        start = max(self._free_s, now_s + thinking) + answer.delay_s
        self._free_s = end = start + len(data) * byte_s
        if self.fast or len(data) < 2:
            self._put(end, data, rate, answer.after)
        else:
            self._put(start + byte_s, data[:1], rate, None)
            self._put(end, data[1:], rate, answer.after)

    def due(self, now_s: float) -> Delivery | None:
        """Take the next delivery that has arrived by now."""
        if self._queue and self._queue[0].at_s <= now_s:
            return self._queue.popleft()
        return None

    def next_s(self) -> float | None:
        """Return when the next bytes arrive, None if none are on their way."""
        return self._queue[0].at_s if self._queue else None

    def clear(self) -> None:
        """Lose everything on the way."""
        self._queue.clear()
        self._free_s = self._arrived_s = 0.0

    def _put(
        self, at_s: float, data: bytes, rate: int, after: ReplyTrigger | None
    ) -> None:
        self._arrived_s = max(self._arrived_s, self.arrival(at_s))
        self._queue.append(Delivery(self._arrived_s, data, rate, after))
