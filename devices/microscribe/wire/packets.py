"""Standard packets of the MicroScribe line.

A packet is ``header, buttons, [timer], [analog..., extra], [encoders...]``. Only the
header has bit 7 set, and that is the whole error detection: no checksum, no length,
no number. A flipped bit 0 to 6 cannot be seen here. MicroScribes have no analog
channels: what stands in their place is passed over.
"""

import struct
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from system import UserError

# Bits 1-0 of a command; not in numeric order.
_ENCODERS = {0b00: 0, 0b01: 5, 0b11: 6, 0b10: 7}
_ANALOG = {0b00: 0, 0b01: 2, 0b10: 4, 0b11: 8}
_TIMESTAMP = 0x20
_HEADER = 0x80


def _length(command: int) -> int:
    analog = _ANALOG[command >> 2 & 0b11]
    timer = 2 if command & _TIMESTAMP else 0
    return 2 + timer + analog + (analog > 0) + 2 * _ENCODERS[command & 0b11]


_LENGTHS = tuple(_length(command) for command in range(0x40))


@dataclass(frozen=True, slots=True)
class PacketLayout:
    """What the packets answering one standard command contain."""

    command: int

    def __post_init__(self) -> None:
        if not 0 <= self.command < 0x40:
            raise UserError(f"a standard command is 0..63, got {self.command}")

    @property
    def header(self) -> int:
        """Return the first byte of the packet."""
        return self.command | _HEADER

    @property
    def encoders(self) -> int:
        """Return how many encoders follow."""
        return _ENCODERS[self.command & 0b11]

    @property
    def timed(self) -> bool:
        """Return whether the timer follows."""
        return bool(self.command & _TIMESTAMP)

    @property
    def length(self) -> int:
        """Return the bytes of a packet, header included."""
        return _LENGTHS[self.command]


class Packet(NamedTuple):
    """One decoded standard packet."""

    command: int
    buttons: int
    timer: int | None = None
    """Ticks of 1/900 s, 14 bits."""
    counts: tuple[int, ...] = ()
    """14 bits each."""


@cache
def _form(command: int) -> tuple[int, int, struct.Struct]:
    """Return length, offset and form of the 7-bit pairs."""
    layout = PacketLayout(command)
    behind = layout.length - 2 * layout.encoders
    return layout.length, behind, struct.Struct(f">{layout.encoders}H")


def decode_packet(data: bytes) -> Packet:
    """Read one packet; raise ValueError unless its bytes have the legal form."""
    command = data[0] & ~_HEADER if data else 0
    length, behind, pairs = _form(command)
    if len(data) != length:
        raise UserError(f"packet must have {length} bytes, got {len(data)}")
    if data[0] < _HEADER or not data[1:].isascii():
        raise UserError(f"bit 7 belongs to the header alone, got {data.hex(' ')}")
    timer = data[2] << 7 | data[3] if command & _TIMESTAMP else None
    counts = tuple(
        [word >> 1 & 0x3F80 | word & 0x7F for word in pairs.unpack_from(data, behind)]
    )
    return Packet(command, data[1], timer, counts)
