"""Standard packets as an arm sends them.

Written apart from the driver's reader of packets, so that neither hides a mistake of
the other, and because the Interface Box counts its encoders differently.
"""

from collections.abc import Mapping

from devices.microscribe.emulator.motion_report import Reading

_ANALOG_CHANNELS = (0, 2, 4, 8)
_TIMESTAMP = 0x20
_SEVEN_BITS = 0x7F


def standard_packet(
    command: int, reading: Reading, timer: int, encoder_codes: Mapping[int, int]
) -> bytes:
    """Return the reply to a standard command: only its first byte has bit 7 set."""
    out = bytearray((command & 0x3F | 0x80, reading.buttons & _SEVEN_BITS))
    if command & _TIMESTAMP:
        out += bytes((timer >> 7 & _SEVEN_BITS, timer & _SEVEN_BITS))
    channels = _ANALOG_CHANNELS[command >> 2 & 0b11]
    if channels:
        values = reading.analog[:channels]
        out += bytes(value >> 1 for value in values)
        # The eighth channel's lowest bit has no place.
        out.append(sum((value & 1) << 6 - i for i, value in enumerate(values[:7])))
    for i in range(encoder_codes[command & 0b11]):
        count = reading.counts[i] if i < len(reading.counts) else 0
        out += bytes((count >> 7 & _SEVEN_BITS, count & _SEVEN_BITS))
    return bytes(out)


def packet_length(command: int, encoder_codes: Mapping[int, int]) -> int:
    """Return the bytes of the reply to a standard command, header included."""
    channels = _ANALOG_CHANNELS[command >> 2 & 0b11]
    timer = 2 if command & _TIMESTAMP else 0
    encoders = encoder_codes[command & 0b11]
    return 2 + timer + channels + bool(channels) + 2 * encoders
