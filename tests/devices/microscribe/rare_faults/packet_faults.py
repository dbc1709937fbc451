"""Faults F9 and F11: bytes of packets, lost or wrong."""

from dataclasses import replace

from devices.microscribe.emulator.answer import Answer, AnswerKind
from devices.microscribe.emulator.faults.fault import Fault, FaultyArm

_PACKETS = frozenset((AnswerKind.PACKET,))
_TOP_BIT = 0x80


class DoubledByte(Fault):
    """F9."""

    id, word = "f9", "doubled_byte"
    line = "one byte of a packet comes twice (=POSITION, else any)"
    takes_number = True
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Put a byte in twice."""
        at = _position(self, answer.data)
        return [replace(answer, data=answer.data[: at + 1] + answer.data[at:])]


class WrongTopBit(Fault):
    """F11."""

    id, word = "f11", "wrong_top_bit"
    line = "bit 7 set in the =PAYLOAD, or cleared in the =HEADER"
    variants = ("PAYLOAD", "HEADER")
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Flip the bit that tells a header."""
        data = bytearray(answer.data)
        header = self.variant == "HEADER"
        data[0 if header else self.noise.randrange(1, len(data))] ^= _TOP_BIT
        return [replace(answer, data=bytes(data))]


def _position(fault: Fault, data: bytes) -> int:
    """Return the position asked for, or any."""
    if fault.variant:
        return min(int(fault.number(0)), len(data) - 1)
    return fault.noise.randrange(len(data))
