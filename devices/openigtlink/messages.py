"""TRANSFORM messages of OpenIGTLink, bytes to poses and back.

A message is a header of 58 bytes (version, type, tool name, time stamp, length and
CRC-64 of the body) and a body of twelve big-endian float32: the columns of a rotation
and a translation in mm. The protocol leaves the world's axes open; 3D Slicer takes the
matrix as it is for its own world, which is RAS. So RAS is what goes over the line,
and both ways are converted here.
"""

import re
import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pyigtl import TransformMessage
from pyigtl.messages import CRC64

from devices.pose import read_only_rigid
from disk import UserError

RAS_FROM_LPS = np.diag((-1.0, -1.0, 1.0, 1.0))
"""Its own inverse: right is minus left, anterior minus posterior."""

LONGEST_NAME = 20

LARGEST_BODY = 4096
"""Of a TRANSFORM: 48 bytes, and remarks in the third version of the protocol."""

LARGEST_FOREIGN_BODY = 1 << 28
"""Of other types, which are passed over: images are the largest."""

LARGEST_DRIFT = 1e-3
"""Peers compute in float32; what is further from a rotation than this is none."""

_HEADER = struct.Struct(">H12s20sIIQQ")
_MATRIX = struct.Struct(">12f")
_EXTENSION = struct.Struct(">HHII")
_MARK = b"TRANSFORM\0\0\0"
_TYPE = re.compile(rb"[A-Z][A-Z0-9_]*[\0 ]*")
_NAME = re.compile(rb"[\x20-\x7e\x80-\xff]*\0*")


@dataclass(frozen=True, slots=True, eq=False)
class ToolTransform:
    """Where a tool is.

    name: of the tool, at most 20 bytes.
    time_s: when it was there, seconds since 1970; None where the peer does not say.
    world_from_tool: (4, 4) float64, LPS, mm.
    """

    name: str
    time_s: float | None
    world_from_tool: NDArray[np.float64]

    def __post_init__(self) -> None:
        if not 0 < len(self.name.encode()) <= LONGEST_NAME:
            raise UserError(
                f"a tool's name must have 1 to {LONGEST_NAME} bytes, got {self.name!r}"
            )
        rigid = read_only_rigid(self.world_from_tool, "world_from_tool")
        object.__setattr__(self, "world_from_tool", rigid)


def encode(transform: ToolTransform) -> bytes:
    """Compose the message, in the first version, which every peer can read."""
    message = TransformMessage(
        RAS_FROM_LPS @ transform.world_from_tool,
        device_name=transform.name,
        timestamp=0.0 if transform.time_s is None else transform.time_s,
    )
    packed: bytes = message.pack()
    return packed


class TransformReader:
    """Cut bytes into transforms, however they arrive; other messages are passed over.

    Nothing is taken whose CRC is wrong. After bytes that are no message, reading
    begins again at the next TRANSFORM.
    """

    def __init__(self) -> None:
        self.foreign = 0
        """Messages of other types."""
        self.damaged = 0
        """Messages with a wrong CRC."""
        self.refused = 0
        """Whole messages that hold no rigid transform or no proper name."""
        self.garbage = 0
        """Bytes that belong to no message."""
        self._buffer = bytearray()
        self._skip = 0
        self._is_lost = False

    def restart(self) -> None:
        """Forget a message that came in part: another line begins."""
        self._buffer.clear()
        self._skip = 0
        self._is_lost = False

    def feed(self, data: bytes) -> list[ToolTransform]:
        """Return the transforms that are complete now."""
        self._buffer += data
        found: list[ToolTransform] = []
        while (
            self._pass_over()
            and self._is_at_message()
            and len(self._buffer) >= _HEADER.size
        ):
            version, kind, name, *_, length, crc = self._fields()
            if not _is_plausible(version, kind, name, length):
                self._resynchronise()
            elif kind != _MARK:
                self.foreign += 1
                self._skip = _HEADER.size + length
            elif len(self._buffer) < _HEADER.size + length:
                break
            elif CRC64(self._body(length)) != crc:
                self.damaged += 1
                self._resynchronise()
            else:
                self._take(length, found)
        return found

    def _fields(self) -> tuple[int, bytes, bytes, int, int, int, int]:
        return _HEADER.unpack_from(self._buffer)

    def _body(self, length: int) -> bytes:
        return bytes(self._buffer[_HEADER.size : _HEADER.size + length])

    def _pass_over(self) -> bool:
        """Drop what is left of a foreign message; tell whether all of it was there."""
        dropped = min(self._skip, len(self._buffer))
        del self._buffer[:dropped]
        self._skip -= dropped
        return self._skip == 0

    def _resynchronise(self) -> None:
        """Give up what the buffer begins with."""
        del self._buffer[:1]
        self.garbage += 1
        self._is_lost = True

    def _is_at_message(self) -> bool:
        """Drop bytes up to the next TRANSFORM after what was no message.

        Until then nothing is read: what looks like another message may be a piece of
        something.
        """
        if not self._is_lost:
            return True
        at = self._buffer.find(_MARK, 2)
        # The mark may be cut at the end; its message begins two bytes before it.
        dropped = at - 2 if at >= 0 else max(len(self._buffer) - len(_MARK) - 1, 0)
        del self._buffer[:dropped]
        self.garbage += dropped
        self._is_lost = at < 0
        return not self._is_lost

    def _take(self, length: int, found: list[ToolTransform]) -> None:
        version, _, name, seconds, fraction, *_ = self._fields()
        body = self._body(length)
        del self._buffer[: _HEADER.size + length]
        content = body if version == 1 else _content(body)
        stamp = seconds + fraction / 2**32
        try:
            found.append(
                ToolTransform(
                    name.rstrip(b"\0 ").decode(),
                    stamp or None,
                    RAS_FROM_LPS @ _matrix(content),
                )
            )
        except ValueError:
            # Of what a peer sends, only this message is wrong; the line is in order.
            self.refused += 1


def _is_plausible(version: int, kind: bytes, name: bytes, length: int) -> bool:
    if not (1 <= version <= 3 and _TYPE.fullmatch(kind) and _NAME.fullmatch(name)):
        return False
    return length <= (LARGEST_BODY if kind == _MARK else LARGEST_FOREIGN_BODY)


def _content(body: bytes) -> bytes:
    """Cut the remarks off a body of the later versions; empty when it is malformed."""
    if len(body) < _EXTENSION.size:
        return b""
    head, index, remarks, _ = _EXTENSION.unpack_from(body)
    return body[head : len(body) - index - remarks]


def _matrix(content: bytes) -> NDArray[np.float64]:
    """Read a rigid matrix; ValueError when it is none.

    A rotation is left as it came, to the bit, while it is one to float32; a rougher
    one is brought to the nearest rotation (polar decomposition).
    """
    if len(content) != _MATRIX.size:
        raise UserError(f"a transform has {_MATRIX.size} bytes, got {len(content)}")
    matrix = np.eye(4)
    matrix[:3] = np.array(_MATRIX.unpack(content)).reshape(4, 3).T
    rotation = matrix[:3, :3]
    if not np.isfinite(matrix).all():
        raise UserError("a transform must be finite")
    drift = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if 5e-7 < drift < LARGEST_DRIFT:
        u, _, vt = np.linalg.svd(rotation)
        matrix[:3, :3] = u @ vt
    return matrix
