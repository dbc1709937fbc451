"""Transform sequences of 3D Slicer and PLUS: ``.seq.mha``, ``.igs.mha``, ``.seq.nrrd``.

An image file whose header carries, for each frame, named transforms, their status and a
time stamp::

    Seq_Frame0000_ScopeTipToRasTransform = 16 numbers in row order
    Seq_Frame0000_ScopeTipToRasTransformStatus = OK (or INVALID)
    Seq_Frame0000_Timestamp = seconds

In MetaImage the header ends with ``ElementDataFile``; in NRRD the same names are keys
(``NAME:=VALUE``) and an empty line ends it. Nothing after the header is read. Sources:
PLUS, "Sequence file"; 3D Slicer, vtkMRMLLinearTransformSequenceStorageNode, whose lines
have at most 1000 characters and whose files without pictures have ``DimSize = 0 0 N``.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from paravol.exchange.tool_motion import (
    LARGEST_FILE,
    MOST_FRAMES,
    Doubles,
    Motions,
    ToolMotion,
    ras_from_lps,
)
from system import UserError, foreign_file, whole_file

ENDINGS = ".mha", ".mhd", ".nrrd", ".nhdr"

_IDENTITY = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"

_LONGEST_LINE = 1 << 16
"""Bytes; Slicer's own limit is a thousand, a list of kinds or values may be longer."""

_META_HEAD = """\
ObjectType = Image
NDims = 3
AnatomicalOrientation = RAI
BinaryData = True
BinaryDataByteOrderMSB = False
CompressedData = False
TransformMatrix = 1 0 0 0 1 0 0 0 1
Offset = 0 0 0
CenterOfRotation = 0 0 0
ElementSpacing = 1 1 1
DimSize = 0 0 {}
ElementType = MET_UCHAR
Kinds = domain domain list"""

_NRRD_HEAD = """\
NRRD0005
type: unsigned char
dimension: 4
space: right-anterior-superior
sizes: 1 1 1 {}
space directions: (1,0,0) (0,1,0) (0,0,1) none
kinds: domain domain domain list
encoding: raw
space origin: (0,0,0)"""
"""NRRD has no empty pictures: each frame has one of a single pixel."""

_FRAME = re.compile(rb"Seq_Frame(\d+)_(\w+?)\s*(?:=|:=)\s*(.*)")


def write_sequence(file: Path, motions: Motions) -> None:
    """Write tools that share their times; the file's ending says the format.

    An invalid pose is written as the identity with the status INVALID. Times and poses
    keep all their digits (Slicer rounds times to the millisecond when it reads them).
    """
    tools = motions.tools
    times = tools[0].time_s
    if any(not np.array_equal(tool.time_s, times) for tool in tools):
        raise UserError("a sequence needs tools of the same times")
    if file.suffix not in (".mha", ".nrrd"):
        raise UserError(f"a sequence goes to a .mha or .nrrd file, got {file}")
    is_nrrd = file.suffix == ".nrrd"
    count = len(times)
    equals = ":=" if is_nrrd else " = "
    rows = [
        (
            f"{tool.name}Transform",
            ras_from_lps(tool.world_from_tool).reshape(-1, 16).tolist(),
            tool.valid.tolist(),
        )
        for tool in tools
    ]
    lines = [(_NRRD_HEAD if is_nrrd else _META_HEAD).format(count)]
    for frame in range(count):
        prefix = f"Seq_Frame{frame:04d}_"
        for name, matrices, valid in rows:
            numbers, status = _IDENTITY, "INVALID"
            if valid[frame]:
                numbers, status = " ".join(map(repr, matrices[frame])), "OK"
            lines.append(f"{prefix}{name}{equals}{numbers}")
            lines.append(f"{prefix}{name}Status{equals}{status}")
        lines.append(f"{prefix}Timestamp{equals}{float(times[frame])!r}")
        lines.append(f"{prefix}UnfilteredTimestamp{equals}{float(times[frame])!r}")
        if is_nrrd:
            lines.append(f"{prefix}Status{equals}INVALID")  # of the picture
    content = "\n".join(lines).encode()
    if is_nrrd:
        content += b"\n\n" + bytes(count)
    else:
        content += b"\nElementDataFile = LOCAL\n"
    with whole_file(file) as beside:
        beside.write_bytes(content)


def read_sequence(file: Path) -> Motions:
    """Read the transforms of a sequence file, its pictures left alone.

    A pose without a status is valid; a frame that lacks one of the transforms, or its
    time, is invalid. ForeignFileError where the file is none.
    """
    with foreign_file(file, "a transform sequence"):
        frames: dict[int, dict[str, bytes]] = {}
        for number, name, value in _fields(file):
            if number >= MOST_FRAMES:
                raise UserError(f"it has more than {MOST_FRAMES} frames")
            frames.setdefault(number, {})[name] = value
        order = sorted(frames)
        names = sorted(
            {n for said in frames.values() for n in said if n.endswith("Transform")}
        )
        if not names:
            raise UserError("it has no transform of any frame")
        times = np.array([_number(frames[i].get("Timestamp")) for i in order])
        tools = []
        for name in names:
            matrices = np.stack([_matrix(frames[i].get(name)) for i in order])
            status = [frames[i].get(f"{name}Status", b"OK").upper() for i in order]
            valid = np.array([word == b"OK" for word in status])
            valid &= np.isfinite(times) & np.isfinite(matrices).all(axis=(1, 2))
            matrices[~valid] = np.eye(4)
            short = name.removesuffix("Transform")
            tools.append(ToolMotion(short, times, ras_from_lps(matrices), valid))
        return Motions(tuple(tools))


def _fields(file: Path) -> Iterator[tuple[int, str, bytes]]:
    """Give the header's fields that belong to frames: number, name, value."""
    with open(file, "rb") as stream:
        size = 0
        is_first = True
        is_nrrd = False
        while line := stream.readline(_LONGEST_LINE):
            size += len(line)
            if size > LARGEST_FILE:
                raise UserError("its header is too large for a recording")
            if is_first:
                is_nrrd = line.startswith(b"NRRD")
                if not is_nrrd and not line.startswith(b"ObjectType"):
                    raise UserError("it begins like no MetaImage or NRRD file")
                is_first = False
            if is_nrrd and not line.strip():
                return
            if not is_nrrd and line.startswith(b"ElementDataFile"):
                return
            found = _FRAME.match(line.strip())
            if found is not None:
                yield int(found[1]), found[2].decode("ascii"), found[3]


def _number(word: bytes | None) -> float:
    return float("nan") if word is None else float(word)


def _matrix(words: bytes | None) -> Doubles:
    if words is None:
        return np.full((4, 4), np.nan)
    numbers = [float(word) for word in words.split()]
    if len(numbers) != 16:
        raise UserError(f"a transform has {len(numbers)} numbers, not 16")
    return np.array(numbers).reshape(4, 4)
