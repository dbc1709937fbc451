"""What ranks say to each other, as fixed binary records.

A message is a header of 64 bytes, little-endian, and a payload of raw bytes. Nothing
that arrives is ever unpickled.

The first five kinds are those of the 1995 paper (section 3). KEEP, ADOPT and ADOPTED
are added: with them every request to drop a cell is answered once, and the last copy of
a cell can leave a rank that has no room (docs/ranks.md). The rest control a frame.
"""

import zlib
from enum import IntEnum
from typing import NamedTuple

import numpy as np

HEADER_BYTES = 64
LARGEST_PAYLOAD = 1 << 28
"""Longest payload accepted, bytes: 30 times a 512 x 512 picture's region."""

_HEADER = np.dtype(
    {
        "names": [
            *("magic", "kind", "source", "target", "cell", "frame", "size", "crc"),
            *("generation", "who", "aux", "sequence"),
        ],
        "formats": ["<u4", "u1", "<u2", "<u2", *["<u4"] * 8],
        "offsets": [0, 4, 6, 8, *range(12, 44, 4)],
        "itemsize": HEADER_BYTES,
    }
)
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


CELL_KINDS = frozenset(MessageKind(number) for number in range(1, 9))
"""Those that a node handles; the others are between the drivers of ranks."""


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
        header = np.zeros((), _HEADER)
        header["magic"] = _MAGIC
        header["kind"] = self.kind
        header["source"] = self.source
        header["target"] = self.target
        header["cell"] = self.cell
        header["frame"] = self.frame
        header["size"] = len(self.payload)
        header["crc"] = zlib.crc32(self.payload)
        header["generation"] = self.generation
        header["who"] = self.who
        header["aux"] = self.aux
        header["sequence"] = sequence & 0xFFFFFFFF
        return header.tobytes() + self.payload

    @classmethod
    def decode(cls, record: bytes) -> "Message":
        """Read a record; raise ProtocolError that says what is wrong with it."""
        if len(record) < HEADER_BYTES:
            raise ProtocolError(f"a message of {len(record)} bytes has no header")
        header = np.frombuffer(record, _HEADER, count=1)[0]
        payload = bytes(record[HEADER_BYTES:])
        if header["magic"] != _MAGIC:
            raise ProtocolError("a message does not begin like one")
        if header["size"] != len(payload) or len(payload) > LARGEST_PAYLOAD:
            raise ProtocolError(
                f"a message announces {header['size']} bytes and has {len(payload)}"
            )
        if header["crc"] != zlib.crc32(payload):
            raise ProtocolError("a message was damaged on its way")
        try:
            kind = MessageKind(int(header["kind"]))
        except ValueError as error:
            raise ProtocolError(f"no message has kind {header['kind']}") from error
        return cls(
            kind,
            int(header["source"]),
            int(header["target"]),
            int(header["frame"]),
            int(header["cell"]),
            payload,
            int(header["generation"]),
            int(header["who"]),
            int(header["aux"]),
        )


def sequence_of(record: bytes) -> int:
    """Read the number that `Message.encode` was given, modulo 2**32."""
    return int.from_bytes(record[40:44], "little")
