"""Standard packets as an arm sends them, on demand or in a motion report.

Written apart from the driver's reader of packets, so that neither hides a mistake of
the other, and because the Interface Box counts its encoders differently.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from devices.microscribe.kinematics.arm import FIELD

TICKS_PER_S = 900.0

ARGUMENTS = 24
ARGUMENTS_OF_SEVEN = 26

_BUTTONS, _ENCODERS = 3, 12


@dataclass(frozen=True, slots=True)
class Reading:
    """What an arm measures at one moment."""

    counts: tuple[int, ...]
    """14 bits each; six, or seven with a rotary table."""
    buttons: int


@dataclass(slots=True)
class MotionReport:
    """One motion report under way: packets that the arm sends by itself.

    Its arguments are two bytes of delay in timer ticks, the standard command whose
    packet is wanted, the buttons whose change counts, eight analog and six (or seven)
    encoder thresholds; a threshold of zero means never. All zero: packets at a fixed
    rate, moved or not.
    """

    arguments: bytes
    """What followed the command byte, 24 or 26 bytes."""
    due_s: float
    """When the arm looks next whether to send."""
    sent: Reading
    """What the last packet said; before the first, what was measured at the start."""

    @property
    def command(self) -> int:
        """Return the standard command whose packets are sent."""
        return self.arguments[2] & 0x3F

    @property
    def period_s(self) -> float:
        """Return the least time between two packets."""
        return int.from_bytes(self.arguments[:2], "big") / TICKS_PER_S

    @property
    def is_fixed_rate(self) -> bool:
        """Return whether packets are sent whatever the arm does."""
        return not any(self.arguments[_BUTTONS:])

    def wants(self, now: Reading) -> bool:
        """Return whether ``now`` is far enough from what was sent last."""
        if self.is_fixed_rate:
            return True
        if (now.buttons ^ self.sent.buttons) & self.arguments[_BUTTONS]:
            return True
        words = self.arguments[_ENCODERS:]
        for i, (new, old) in enumerate(zip(now.counts, self.sent.counts, strict=True)):
            limit = int.from_bytes(words[2 * i : 2 * i + 2], "big")
            moved = abs((new - old + FIELD // 2) % FIELD - FIELD // 2)
            if limit and moved >= limit:
                return True
        return False


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
    # No arm has analog channels; they, and a byte of their lowest bits, read 0.
    channels = _ANALOG_CHANNELS[command >> 2 & 0b11]
    out += bytes(channels + bool(channels))
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
