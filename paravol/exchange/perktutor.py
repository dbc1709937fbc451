"""PerkTutor's recordings: the XML that its Transform Recorder writes and reads.

A ``TransformRecorderLog`` of ``log`` elements in any order. Each has ``TimeStampSec``
and ``TimeStampNSec``, whole numbers, and a ``type``: a ``transform`` has ``DeviceName``
and ``transform``, 16 numbers in row order, RAS mm; a ``message`` has its text. Source:
PerkTutor, TransformRecorder/qSlicerTrackedSequenceBrowserWriter.cxx and ...Reader.cxx.

Read with expat; a document type, which entities need, is refused before anything of it
is looked at.
"""

import math
from collections import defaultdict
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import numpy as np

from paravol.exchange.tool_motion import (
    LARGEST_FILE,
    MOST_FRAMES,
    Message,
    Motions,
    ToolMotion,
    ras_from_lps,
)
from system import UserError, foreign_file, whole_file

ROOT = "TransformRecorderLog"

_NS = 1_000_000_000

_PART = 1 << 20
"""Bytes that are parsed at a time."""


def write_perktutor(file: Path, motions: Motions) -> None:
    """Write a recording; invalid poses are left out, for the format has no word for it.

    Times are written to the nanosecond, poses with all their digits.
    """
    lines = [f"<{ROOT}>"]
    for tool in motions.tools:
        name = quoteattr(tool.name)
        matrices = ras_from_lps(tool.world_from_tool).reshape(-1, 16)
        for place in np.flatnonzero(tool.valid):
            numbers = " ".join(repr(v) for v in matrices[place].tolist())
            lines.append(
                f'  <log {_stamp(tool.time_s[place])} type="transform" '
                f'DeviceName={name} transform="{numbers}" />'
            )
    lines += [
        f'  <log {_stamp(message.time_s)} type="message" '
        f"message={quoteattr(message.text)} />"
        for message in motions.messages
    ]
    lines.append(f"</{ROOT}>\n")
    with whole_file(file) as beside:
        beside.write_text("\n".join(lines), "utf-8")


def read_perktutor(file: Path) -> Motions:
    """Read a recording; each tool in the order of time, as Slicer sorts it too.

    ForeignFileError where the file is none, or has a document type.
    """
    log = _Log()
    parser = expat.ParserCreate()
    parser.StartElementHandler = log.start
    parser.EndElementHandler = log.end
    parser.StartDoctypeDeclHandler = _refuse_doctype
    with foreign_file(file, "a PerkTutor recording"):
        with open(file, "rb") as stream:
            size = 0
            while part := stream.read(_PART):
                size += len(part)
                if size > LARGEST_FILE:
                    raise UserError("it is too large for a recording")
                parser.Parse(part, False)
            parser.Parse(b"", True)
        return log.motions()


def _stamp(time_s: float) -> str:
    """Return a time as PerkTutor splits it; the nanoseconds are never negative."""
    whole = math.floor(time_s)
    ns = round((time_s - whole) * _NS)
    whole, ns = whole + ns // _NS, ns % _NS
    return f'TimeStampSec="{whole}" TimeStampNSec="{ns}"'


def _refuse_doctype(*_words: object) -> None:
    raise UserError("it has a document type, which no recording needs")


class _Log:
    """Take in the elements of a recording as they come."""

    def __init__(self) -> None:
        self._depth = 0
        self._poses: defaultdict[str, list[tuple[float, list[float]]]]
        self._poses = defaultdict(list)
        self._messages: list[Message] = []
        self._count = 0

    def start(self, name: str, said: dict[str, str]) -> None:
        """Take in the beginning of an element."""
        self._depth += 1
        if self._depth == 1 and name != ROOT:
            raise UserError(f"it begins with {name}, not with {ROOT}")
        if self._depth != 2 or name != "log":
            return
        self._count += 1
        if self._count > MOST_FRAMES:
            raise UserError(f"it has more than {MOST_FRAMES} entries")
        kind = said.get("type")
        if kind not in ("transform", "message"):
            return
        time_s = _time(said)
        if kind == "message":
            self._messages.append(Message(time_s, said.get("message", "")))
            return
        numbers = [float(word) for word in said["transform"].split()]
        if len(numbers) != 16:
            raise UserError(f"a transform has {len(numbers)} numbers, not 16")
        self._poses[said["DeviceName"]].append((time_s, numbers))

    def end(self, name: str) -> None:
        """Take in the end of an element."""
        self._depth -= 1

    def motions(self) -> Motions:
        """Return all of it."""
        tools = []
        for name, poses in self._poses.items():
            poses.sort(key=lambda pose: pose[0])
            matrices = np.array([numbers for _, numbers in poses]).reshape(-1, 4, 4)
            times = np.array([time_s for time_s, _ in poses])
            valid = np.ones(len(times), np.bool_)
            tools.append(
                ToolMotion(
                    name.removesuffix("Transform"), times, ras_from_lps(matrices), valid
                )
            )
        self._messages.sort(key=lambda message: message.time_s)
        return Motions(tuple(tools), tuple(self._messages))


def _time(said: dict[str, str]) -> float:
    # whole numbers first: nanoseconds of a day in the epoch need more than 53 bits
    return int(said["TimeStampSec"]) + int(said["TimeStampNSec"]) / _NS
