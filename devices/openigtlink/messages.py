"""Poses in messages of OpenIGTLink, bytes to poses and back.

A message is a header of 58 bytes (version, type, tool name, time stamp, length and
CRC-64 of the body) and a body. That of a TRANSFORM is twelve big-endian float32: the
columns of a rotation and a translation in mm. POSITION holds a place and a quaternion,
TDATA and QTDATA hold several tools. From the second version on remarks follow, as PLUS
sends them: whether the tool was seen, and its whole name. The protocol leaves the
world's axes open; 3D Slicer takes the matrix as it is for its own world, which is RAS.
So RAS is what goes over the line, and both ways are converted here.
"""

import re
import struct
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pyigtl import TransformMessage
from pyigtl.messages import CRC64

from devices.pose import read_only_rigid
from system import UserError

RAS_FROM_LPS = np.diag((-1.0, -1.0, 1.0, 1.0))
"""Its own inverse: right is minus left, anterior minus posterior."""

LONGEST_NAME = 20
"""Bytes of a name in a header; remarks may hold a longer one."""

NAME, STATUS, VALID = "IGTL_DEVICE_NAME", "TransformStatus", "TransformValid"
"""Remarks about a tool: its whole name, and whether it was seen, as PLUS says."""

SEEN = ("OK", "SWITCH1_IS_ON", "SWITCH2_IS_ON", "SWITCH3_IS_ON")
"""What PLUS says of a tool that was seen."""

MISSING_MM = 1e5
"""Trackers write numbers beyond that, -3.697e28 for one, where nothing was measured."""

LARGEST_BODY = 4096
"""Of a TRANSFORM: 48 bytes, and remarks in the third version of the protocol."""

LARGEST_FOREIGN_BODY = 1 << 28
"""Of other types, which are passed over: images are the largest."""

LARGEST_DRIFT = 1e-3
"""Peers compute in float32; what is further from a rotation than this is none."""

MOST_TOLD = 6
"""Names, and reasons, that are remembered to be told."""

_HEADER = struct.Struct(">H12s20sIIQQ")
_MATRIX = struct.Struct(">12f")
_EXTENSION = struct.Struct(">HHII")
_REMARK = struct.Struct(">HHI")
_TOOLS = {b"TDATA": struct.Struct(">20sBB12f"), b"QTDATA": struct.Struct(">20sBB7f")}
"""One tool of a message that holds several: its name, its kind, and its pose."""
_KINDS = (b"TRANSFORM", b"POSITION", *_TOOLS)
_MARK = b"TRANSFORM\0\0\0"
_TYPE = re.compile(rb"[A-Z][A-Z0-9_]*[\0 ]*")
_NAME = re.compile(rb"[\x20-\x7e\x80-\xff]*\0*")


@dataclass(frozen=True, slots=True, eq=False)
class ToolTransform:
    """Where a tool is.

    name: of the tool.
    time_s: when it was there, seconds since 1970; None where the peer does not say.
    world_from_tool: (4, 4) float64, LPS, mm. status: "" where it was seen; else why
    the pose counts for nothing.
    """

    name: str
    time_s: float | None
    world_from_tool: NDArray[np.float64]
    status: str = ""

    def __post_init__(self) -> None:
        if not self.name:
            raise UserError(
                "a tool must have a name, of 1 to 20 bytes where it is sent"
            )
        rigid = read_only_rigid(self.world_from_tool, "world_from_tool")
        object.__setattr__(self, "world_from_tool", rigid)


def check_name(name: str) -> None:
    """Refuse a name that a header does not hold; UserError."""
    if not 0 < len(name.encode()) <= LONGEST_NAME:
        raise UserError(
            f"a tool's name must have 1 to {LONGEST_NAME} bytes, got {name!r}"
        )


def greeting() -> bytes:
    """Compose a request for a status in the second version of the protocol.

    PLUS answers in the highest version that its client has spoken, and only from the
    second on it says whether a tool was seen.
    """
    body = _EXTENSION.pack(_EXTENSION.size, 2, 0, 0) + struct.pack(">H", 0)
    kind = b"GET_STATUS".ljust(12, b"\0")
    name = b"PARAVOL".ljust(LONGEST_NAME, b"\0")
    return _HEADER.pack(2, kind, name, 0, 0, len(body), CRC64(body)) + body


def encode(transform: ToolTransform) -> bytes:
    """Compose the message, in the first version, which every peer can read.

    Raises UserError for a name that a header does not hold.
    """
    check_name(transform.name)
    message = TransformMessage(
        RAS_FROM_LPS @ transform.world_from_tool,
        device_name=transform.name,
        timestamp=0.0 if transform.time_s is None else transform.time_s,
    )
    packed: bytes = message.pack()
    return packed


class TransformReader:
    """Cut bytes into transforms, however they arrive; other messages are passed over.

    Nothing is taken whose CRC is wrong; some peers compute none and send 0. After
    bytes that are no message, reading begins again at the next TRANSFORM.
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
        self.reasons: Counter[str] = Counter()
        """Why messages were not used, and how often; the first few reasons."""
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
            elif _bare(kind) not in _KINDS:
                self.foreign += 1
                self._tell(f"of type {_bare(kind).decode('ascii')}")
                self._skip = _HEADER.size + length
            elif len(self._buffer) < _HEADER.size + length:
                break
            elif crc and CRC64(self._body(length)) != crc:
                self.damaged += 1
                self._tell("with a wrong checksum")
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

    def _tell(self, reason: str) -> None:
        if reason in self.reasons or len(self.reasons) < MOST_TOLD:
            self.reasons[reason] += 1

    def _take(self, length: int, found: list[ToolTransform]) -> None:
        version, kind, name, seconds, fraction, *_ = self._fields()
        body = self._body(length)
        del self._buffer[: _HEADER.size + length]
        stamp = (seconds + fraction / 2**32) or None
        try:
            content, remarks = (body, {}) if version == 1 else _parted(body)
            own = _text(name)
            for tool, matrix in _poses(_bare(kind), content):
                full = remarks.get(NAME, own) if tool is None else tool
                frame, status = _placed(matrix, remarks)
                found.append(ToolTransform(full, stamp, frame, status))
        except (ValueError, struct.error) as error:
            # Of what a peer sends, only this message is wrong; the line is in order.
            self.refused += 1
            self._tell(f"refused ({error})")


def _bare(kind: bytes) -> bytes:
    return kind.rstrip(b"\0 ")


def _text(name: bytes) -> str:
    return name.partition(b"\0")[0].rstrip(b" ").decode()


def _is_plausible(version: int, kind: bytes, name: bytes, length: int) -> bool:
    if not (1 <= version <= 3 and _TYPE.fullmatch(kind) and _NAME.fullmatch(name)):
        return False
    return length <= (LARGEST_BODY if _bare(kind) in _KINDS else LARGEST_FOREIGN_BODY)


def _parted(body: bytes) -> tuple[bytes, Mapping[str, str]]:
    """Part a body of the later versions into content and remarks.

    Raises UserError where it is malformed.
    """
    if len(body) < _EXTENSION.size:
        raise UserError("it is too short for its version")
    head, index_bytes, value_bytes, _ = _EXTENSION.unpack_from(body)
    end = len(body) - index_bytes - value_bytes
    if not _EXTENSION.size <= head <= end:
        raise UserError("its parts are longer than it is")
    index, values = body[end : end + index_bytes], body[end + index_bytes :]
    remarks = {}
    count = int.from_bytes(index[:2], "big")
    for n in range(count):
        if len(index) < 2 + (n + 1) * _REMARK.size:
            break
        key, _, value = _REMARK.unpack_from(index, 2 + n * _REMARK.size)
        name, text = values[:key], values[key : key + value]
        values = values[key + value :]
        remarks[name.decode("utf-8", "replace")] = text.decode("utf-8", "replace")
    return body[head:end], remarks


def _poses(kind: bytes, content: bytes) -> list[tuple[str | None, NDArray[np.float64]]]:
    """Read the poses of a message, ``(4, 4)`` as they came; None names its own tool."""
    if kind in _TOOLS:
        one = _TOOLS[kind]
        if len(content) % one.size:
            raise UserError(f"tools of {one.size} bytes do not fill {len(content)}")
        tools = [
            (_text(name), numbers) for name, _, _, *numbers in one.iter_unpack(content)
        ]
        read = _columns if kind == b"TDATA" else _quaternion
        return [(name, read(numbers)) for name, numbers in tools]
    if kind == b"POSITION":
        if len(content) not in (24, 28):
            raise UserError("a position without an orientation places no tool")
        return [(None, _quaternion(struct.unpack(f">{len(content) // 4}f", content)))]
    if len(content) != _MATRIX.size:
        raise UserError(f"a transform has {_MATRIX.size} bytes, got {len(content)}")
    return [(None, _columns(_MATRIX.unpack(content)))]


def _columns(numbers: Sequence[float]) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3] = np.array(numbers).reshape(4, 3).T
    return matrix


def _quaternion(numbers: Sequence[float]) -> NDArray[np.float64]:
    """Return the pose of a place and a quaternion x y z w; w may be left out."""
    x, y, z, *turn = numbers
    if len(turn) == 3:
        turn.append(float(np.sqrt(max(1.0 - float(np.dot(turn, turn)), 0.0))))
    i, j, k, w = turn
    n = i * i + j * j + k * k + w * w
    scale = 2.0 / n if n > 0.0 else np.nan
    matrix = np.eye(4)
    matrix[:3, :3] -= scale * np.array(
        [
            [j * j + k * k, k * w - i * j, -j * w - i * k],
            [-k * w - i * j, i * i + k * k, i * w - j * k],
            [j * w - i * k, -i * w - j * k, i * i + j * j],
        ]
    )
    matrix[:3, 3] = x, y, z
    return matrix


def _placed(
    matrix: NDArray[np.float64], remarks: Mapping[str, str]
) -> tuple[NDArray[np.float64], str]:
    """Return a rigid pose in LPS, and why it counts for nothing: "" where it counts.

    A rotation is left as it came, to the bit, while it is one to float32; a rougher
    one is brought to the nearest rotation (polar decomposition). Raises UserError for
    one that is none.
    """
    status = remarks.get(STATUS, "").strip().upper().removeprefix("TOOL_")
    is_valid = remarks.get(VALID, "1").strip().lower() not in ("0", "false")
    if (status and status not in SEEN) or not (is_valid or status):
        return np.eye(
            4
        ), f"the tool is {(status or 'invalid').lower().replace('_', ' ')}"
    rotation = matrix[:3, :3]
    if np.abs(matrix[:3, 3]).max() > MISSING_MM:
        return np.eye(4), "the tool is missing"
    if not np.isfinite(matrix).all():
        raise UserError("a transform must be finite")
    drift = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if 5e-7 < drift < LARGEST_DRIFT:
        u, _, vt = np.linalg.svd(rotation)
        matrix[:3, :3] = u @ vt
    elif drift >= LARGEST_DRIFT:
        factor = float(np.cbrt(abs(np.linalg.det(rotation))))
        raise UserError(f"its axes are no rotation; their length is {factor:.4g}")
    return RAS_FROM_LPS @ matrix, ""
