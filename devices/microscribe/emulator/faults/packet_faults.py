"""Faults F8 to F12: bytes of packets, lost or wrong."""

from dataclasses import replace

from devices.microscribe.emulator.answer import Answer, AnswerKind
from devices.microscribe.emulator.faults.fault import EVERY_KIND, Fault, FaultyArm

_PACKETS = frozenset((AnswerKind.PACKET,))
_TOP_BIT = 0x80
_MOST_NOISE = 8


class DroppedByte(Fault):
    """F8."""

    id, word = "f8", "dropped_byte"
    line = "one byte of a packet is lost (=POSITION, else any)"
    takes_number = True
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Leave a byte out."""
        at = _position(self, answer.data)
        return [replace(answer, data=answer.data[:at] + answer.data[at + 1 :])]


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


class FlippedBit(Fault):
    """F10."""

    id, word = "f10", "flipped_bit"
    line = "one of bits 0-6 of a payload byte is flipped: no reader can see it"
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Flip a bit that no rule protects."""
        data = bytearray(answer.data)
        data[self.noise.randrange(1, len(data))] ^= 1 << self.noise.randrange(7)
        return [replace(answer, data=bytes(data))]


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


class Noise(Fault):
    """F12."""

    id, word = "f12", "noise"
    line = "1-8 random bytes in front of a packet, =MIXED, LOW or HIGH (bit 7)"
    variants = ("MIXED", "LOW", "HIGH")
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Put noise between this packet and the one before."""
        noise = bytearray(self.noise.randbytes(self.noise.randint(1, _MOST_NOISE)))
        for i, byte in enumerate(noise):
            if self.variant == "LOW":
                noise[i] = byte & ~_TOP_BIT
            elif self.variant == "HIGH":
                noise[i] = byte | _TOP_BIT
        return [Answer(AnswerKind.FOREIGN, bytes(noise)), answer]


class Garbage(Fault):
    """Every answer becomes random bytes of about its length."""

    id, word = "", "garbage"
    line = "every answer becomes random bytes of about its length"
    lasts = True
    kinds = EVERY_KIND

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Say nothing that makes sense."""
        noise = self.noise.randbytes(len(answer.data) + self.noise.randrange(3))
        return [replace(answer, data=noise)]


def _position(fault: Fault, data: bytes) -> int:
    """Return the position asked for, or any."""
    if fault.variant:
        return min(int(fault.number(0)), len(data) - 1)
    return fault.noise.randrange(len(data))
