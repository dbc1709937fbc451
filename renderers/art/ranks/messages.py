"""What ranks say to each other, as fixed binary records.

A message is a header of 64 bytes, little-endian, and a payload of raw bytes. Nothing
that arrives is ever unpickled.

The first five kinds are those of the 1995 paper (section 3). KEEP, ADOPT and ADOPTED
are added: with them every request to drop a cell is answered once, and the last copy of
a cell can leave a rank that has no room (docs/ranks.md). The rest control a frame.
"""

import struct
import zlib
from collections.abc import Iterator
from enum import IntEnum
from typing import NamedTuple

HEADER_BYTES = 64
LARGEST_PAYLOAD = 1 << 28
"""Longest payload accepted, bytes: 30 times a 512 x 512 picture's region."""

_HEADER = struct.Struct("<IBxHHxx8I20x")
"""Magic, kind, source, target; then cell, frame, size, crc, generation, who, aux,
sequence."""

_MAGIC = 0x31545241


class ProtocolError(RuntimeError):
    """Another rank said something that the protocol does not allow."""


class MessageKind(IntEnum):
    """Name what a message asks or brings."""

    REQUEST = 1
    """To a cell's home: I have reserved a slot; get me the cell."""
    FORWARD = 2
    """From the home to a holder: send the cell to rank `who`."""
    DATA = 3
    """The cell's raw values; `aux` is the generation that changed them last."""
    INVALIDATE_REQUEST = 4
    """To the home: may I drop the cell? Answered once, by INVALIDATE or KEEP."""
    INVALIDATE = 5
    """From the home: drop it."""
    KEEP = 6
    """From the home: keep it, for nobody else holds it or can take it over."""
    ADOPT = 7
    """From the home to a holder: will you be the owner, whose copy must stay?"""
    ADOPTED = 8
    """To the home: yes (`aux` is 1) or no (0)."""
    BEGIN = 16
    """From rank 0: draw this; the payload is the job."""
    REGION = 17
    """To rank 0: finished pixels."""
    DONE = 18
    """To rank 0: my rays of this frame are finished, my requests answered."""
    FAILED = 19
    """To rank 0: I cannot take part; the payload says why."""
    END = 20
    """From rank 0: leave this frame. `aux` is 1 when it broke: forget its cells too."""
    STOP = 21
    """From rank 0: there will be no more frames."""
    CANCEL = 22
    """From rank 0: drop your rays of this frame, then say DONE as usual."""
    ABORT = 23
    """I give up, and so must all; the payload says why."""


_KINDS = {int(kind): kind for kind in MessageKind}

CELL_KINDS = frozenset(MessageKind(number) for number in range(1, 9))
"""Those about cells, which a node handles; the others are between ranks' drivers."""


class Message(NamedTuple):
    """Carry one record from rank `source` to rank `target`.

    frame: numbers grow and are never used again. cell, generation, who, aux: as the
    kind says. generation: of the volume; it changes only between frames.
    """

    kind: MessageKind
    source: int
    target: int
    frame: int
    cell: int = 0
    payload: bytes = b""
    generation: int = 0
    who: int = 0
    aux: int = 0

    def encode(self, sequence: int = 0) -> bytes:
        """Write header and payload. sequence: counts the messages of a pair."""
        header = _HEADER.pack(
            _MAGIC,
            self.kind,
            self.source,
            self.target,
            self.cell,
            self.frame,
            len(self.payload),
            zlib.crc32(self.payload),
            self.generation,
            self.who,
            self.aux,
            sequence & 0xFFFFFFFF,
        )
        return header + self.payload

    @classmethod
    def decode(cls, record: bytes) -> "Message":
        """Read a record; raise ProtocolError that says what is wrong with it."""
        if len(record) < HEADER_BYTES:
            raise ProtocolError(f"a message of {len(record)} bytes has no header")
        magic, number, source, target, cell, frame, size, crc, *rest = (
            _HEADER.unpack_from(record)
        )
        payload = bytes(record[HEADER_BYTES:])
        if magic != _MAGIC:
            raise ProtocolError("a message does not begin like one")
        if size != len(payload) or size > LARGEST_PAYLOAD:
            raise ProtocolError(
                f"a message announces {size} bytes and has {len(payload)}"
            )
        if crc != zlib.crc32(payload):
            raise ProtocolError("a message was damaged on its way")
        kind = _KINDS.get(number)
        if kind is None:
            raise ProtocolError(f"no message has kind {number}")
        generation, who, aux, _ = rest
        return cls(kind, source, target, frame, cell, payload, generation, who, aux)


def split_records(bundle: bytes) -> Iterator[bytes]:
    """Part records that were laid end to end; raise ProtocolError where one is cut."""
    at = 0
    while at < len(bundle):
        if len(bundle) - at < HEADER_BYTES:
            raise ProtocolError(f"a message of {len(bundle) - at} bytes has no header")
        size = HEADER_BYTES + _HEADER.unpack_from(bundle, at)[6]
        yield bundle[at : at + size]
        at += size


def sequence_of(record: bytes) -> int:
    """Read the number that `Message.encode` was given, modulo 2**32."""
    return int.from_bytes(record[40:44], "little")
