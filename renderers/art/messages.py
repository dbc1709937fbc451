"""What ranks say to each other, as fixed binary records.

A message is a header of 64 bytes, little-endian, and a payload of raw bytes. Nothing
that arrives is ever unpickled.

Kinds are the object-dataflow words of the 1995 paper, of which cells with static homes
need two, and the control of a frame. Numbers 2, 4 and 5 belong to the paper's Forward,
InvalidateRequest and Invalidate, which moving cells speak.
"""

import zlib
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

HEADER_BYTES = 64
LARGEST_PAYLOAD = 1 << 28
"""Longest payload accepted, bytes: 30 times a 512 x 512 picture's region."""

_HEADER = np.dtype(
    {
        "names": ["magic", "kind", "source", "target", "cell", "frame", "size", "crc"],
        "formats": ["<u4", "u1", "<u2", "<u2", "<u4", "<u4", "<u4", "<u4"],
        "offsets": [0, 4, 6, 8, 12, 16, 20, 24],
        "itemsize": HEADER_BYTES,
    }
)
_MAGIC = 0x31545241


class ProtocolError(RuntimeError):
    """Another rank said something that the protocol does not allow."""


class MessageKind(IntEnum):
    """Name what a message asks or brings."""

    REQUEST = 1
    """To a cell's home: I have reserved a slot; send me the cell."""
    DATA = 3
    """The cell's raw values."""
    BEGIN = 16
    """From rank 0: draw this; the payload is the job."""
    REGION = 17
    """To rank 0: finished pixels."""
    DONE = 18
    """To rank 0: my rays of this frame are finished, my requests answered."""
    FAILED = 19
    """To rank 0: I cannot take part; the payload says why."""
    END = 20
    """From rank 0: leave this frame, finished or not."""
    STOP = 21
    """From rank 0: there will be no more frames."""


@dataclass(frozen=True, slots=True)
class Message:
    """Carry one record from rank `source` to rank `target`.

    cell: only for REQUEST and DATA. frame: numbers grow and are never used again.
    """

    kind: MessageKind
    source: int
    target: int
    frame: int
    cell: int = 0
    payload: bytes = b""

    def encode(self) -> bytes:
        """Write header and payload."""
        header = np.zeros((), _HEADER)
        header["magic"] = _MAGIC
        header["kind"] = self.kind
        header["source"] = self.source
        header["target"] = self.target
        header["cell"] = self.cell
        header["frame"] = self.frame
        header["size"] = len(self.payload)
        header["crc"] = zlib.crc32(self.payload)
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
        )
