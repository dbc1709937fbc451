"""What a UART makes of bytes that were sent at another rate.

8 data bits, no parity, one stop bit. The sender's bits follow one another without a
pause and the line idles high. The receiver takes a falling edge for the beginning of
a start bit and looks at the line in the middle of each of its own ten bit times.
"""

_FRAME = 10
_IDLE_BITS = 4


def misread(
    data: bytes, sent_rate: int, read_rate: int, keep_framing_errors: bool = False
) -> bytes:
    """Return what arrives of ``data``; the same bytes when the rates agree.

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
