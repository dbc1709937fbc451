"""Headers of text as other programs write them, for a reader that knows fewer of them.

ITK knows no bzip2, no lengths but millimetres, and reads a decimal comma as an end. A
header may name any path of the machine, and a pipe that never ends: its values must lie
beside it, and nowhere else.
"""

import bz2
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from renderers.scene.memory_limit import memory_limit
from system import UserError

LONGEST_HEADER = 1 << 20

MOST_FILES = 20_000

LONGEST_TOLD = 200
"""Characters of a name that an error repeats."""

LOCAL = ("local", "list")
"""What a header says in place of a name: in this file, or in the lines that follow."""

UNITS_MM = {"mm": 1.0, "millimeter": 1.0, "millimeters": 1.0, "millimetre": 1.0,
    "cm": 10.0, "m": 1e3, "meter": 1e3, "meters": 1e3, "um": 1e-3, "µm": 1e-3,
    "μm": 1e-3, "micron": 1e-3, "microns": 1e-3, "micrometer": 1e-3,
    "": 1.0}  # fmt: skip
"""Millimetres of a unit's names."""

CHUNK_BYTES = 1 << 20

_NUMBERS = re.compile(
    rb"^\s*(space directions|space origin|spacings|thicknesses|axis ?mins|axis ?maxs|"
    rb"ElementSpacing|ElementSize|Offset|Position|Origin|TransformMatrix|Orientation|"
    rb"Rotation)\s*[:=]",
    re.IGNORECASE,
)
"""Fields of NRRD and of MetaImage that hold numbers with fractions."""

_DATA_FILE = re.compile(
    rb"((?:data ?file\s*:=?|\s*ElementDataFile\s*[=:])\s*)(.*)", re.IGNORECASE
)
_DIMENSIONS = re.compile(rb"\s*NDims\s*[=:]\s*\d{1,2}\s*")
_PATTERN = re.compile(r"%\d{0,2}d")
_RAW = re.compile(rb"^encoding:.*", re.IGNORECASE)
_VECTOR = re.compile(rb"\(([^()]*)\)")
_COMMA = re.compile(rb"(?<=\d),(?=\d)")
_QUOTED = re.compile(r'"([^"]*)"')


@dataclass(frozen=True, slots=True)
class TextHeader:
    """What a file of NRRD or MetaImage begins with.

    head: its first bytes. end: where the header ends; begins: where the values do, if
    they are in the file. fields: by their names in small letters.
    """

    path: Path
    head: bytes
    end: int
    begins: int
    fields: dict[str, str]

    @classmethod
    def read(cls, path: Path) -> "TextHeader":
        """Read a file's first bytes, whatever it is."""
        with path.open("rb") as file:
            head = file.read(LONGEST_HEADER)
        if head.startswith(b"NRRD"):
            found = re.search(rb"\r?\n\r?\n", head)
            end, begins = found.span() if found else (len(head), len(head))
        else:
            found = re.search(rb"ElementDataFile[^\n]*\n", head)
            end = begins = found.end() if found else len(head)
        fields = {}
        for line in head[:end].decode("utf-8", "replace").splitlines():
            key, separator, value = line.partition(":" if ":" in line else "=")
            if separator and not value.startswith("="):
                fields[key.strip().lower()] = value.strip()
        return cls(path, head, end, begins, fields)

    @property
    def is_nrrd(self) -> bool:
        """Return whether it is one of NRRD."""
        return self.head.startswith(b"NRRD")

    @property
    def lines(self) -> list[bytes]:
        """Return the header's lines."""
        return self.head[: self.end].splitlines()


def check_data_files(header: TextHeader) -> None:
    """Refuse a header whose values are not in plain files of its own folder.

    Raises UserError naming the header and the file that it names.
    """
    path = header.path
    is_meta = not header.is_nrrd and path.suffix.lower() in (".mhd", ".mha")
    if not header.is_nrrd and not is_meta:
        return
    # the names of a list follow the last line of a MetaImage's header
    lines = header.head.splitlines() if is_meta else header.lines
    for n, line in enumerate(lines):
        if is_meta and b"NDims" in line and not _DIMENSIONS.fullmatch(line):
            # ITK's reader never comes back from a negative number, or a huge one
            raise UserError(f"{path} does not say how many dimensions it has")
        match = _DATA_FILE.match(line)
        if match is None or is_meta == match[1].lower().startswith(b"data"):
            continue
        words = match[2].decode("utf-8", "replace").strip()
        kind = words.split(" ")[0].lower()
        if kind not in LOCAL:
            _check_named(path, words)
        elif kind == "list":
            listed = lines[n + 1 : n + 1 + MOST_FILES]
            for name in (one.decode("utf-8", "replace").strip() for one in listed):
                if name:
                    check_beside(path, name)
        if is_meta:
            return  # what follows are values
    is_whole = header.is_nrrd and header.end < len(header.head)
    if len(header.head) == LONGEST_HEADER and not is_whole:
        raise UserError(f"{path} has a header without an end")


def _check_named(path: Path, words: str) -> None:
    """Check one name, or a pattern with the numbers of its first and last file."""
    name, *numbers = words.rsplit(" ", 3) if _PATTERN.search(words) else [words]
    pattern = _PATTERN.search(name)
    if pattern is None:
        # a name may hold spaces
        check_beside(path, words)
        return
    try:
        first, last, step = [*(int(n) for n in numbers), 1][:3]
    except ValueError as error:
        raise UserError(f"{path} names its values wrongly: {words!r}") from error
    listed = range(first, last + 1, max(abs(step), 1))
    for number in listed[:MOST_FILES]:
        check_beside(
            path, name[: pattern.start()] + pattern[0] % number + name[pattern.end() :]
        )


def check_beside(path: Path, name: str) -> None:
    """Refuse a name that is no plain file of a header's own folder."""
    told = f"{path} takes its values from {name[:LONGEST_TOLD]}"
    folder = path.parent.resolve()
    target = Path(name)
    if target.is_absolute() or not (folder / target).resolve().is_relative_to(folder):
        raise UserError(
            f"{told}, outside its own folder; put both into one folder, and name the "
            "file alone"
        )
    # a name that no file system holds is not there either; Path.exists would raise
    if not os.path.exists(folder / target):
        raise UserError(f"{told}, which is not there")
    if not (folder / target).is_file():
        raise UserError(f"{told}, which is no plain file")


def units_mm(header: TextHeader) -> tuple[NDArray[np.float64], list[str]]:
    """Return the millimetres of a unit along each axis of space, ``(3,)``, and notes.

    Raises UserError for a unit that is no length.
    """
    path, fields = header.path, header.fields
    told = _QUOTED.findall(fields.get("space units", ""))[:3]
    told = told or [fields.get("distanceunits", "")] * 3
    unknown = [unit for unit in told if unit.strip().lower() not in UNITS_MM]
    if unknown or len(told) != 3:
        raise UserError(
            f"{path} gives its lengths in {', '.join(map(repr, told))}; known are "
            f"{', '.join(name for name in UNITS_MM if name)}"
        )
    factors = np.array([UNITS_MM[unit.strip().lower()] for unit in told])
    if (factors == 1.0).all():
        return factors, []
    unit = " x ".join(dict.fromkeys(told))
    return factors, [f"{path.name} is in {unit}: it is read in millimetres"]


@contextmanager
def readable_copy(header: TextHeader) -> Iterator[Path]:
    """Give the file itself, or a copy for a while that ITK can read.

    Raises UserError for numbers with commas that can be read in two ways, and for
    values that unpack to more than memory holds.
    """
    path, lines, fields = header.path, header.lines, header.fields
    has_time = fields.get("space", "").endswith("-time")
    axes = 4 if has_time or fields.get("space dimension") == "4" else 3
    changed = [_with_points(path, line, axes) for line in lines]
    is_packed = fields.get("encoding", "").lower() in ("bzip2", "bz2")
    if changed == lines and not is_packed:
        yield path
        return
    if is_packed:
        changed = [_RAW.sub(b"encoding: raw", line) for line in changed]
    values, changed = _values(path, changed)
    is_nrrd = header.is_nrrd
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / f"volume{'.nrrd' if is_nrrd else '.mha'}"
        with values.open("rb") as source, copy.open("wb") as target:
            target.write(b"\n".join(changed) + (b"\n\n" if is_nrrd else b"\n"))
            source.seek(header.begins if values == path else 0)
            if is_packed:
                _unpack(path, source, target)
            else:
                shutil.copyfileobj(source, target)
        yield copy


def _unpack(path: Path, source: BinaryIO, target: BinaryIO) -> None:
    """Unpack bzip2 in pieces, no more than memory holds."""
    limit, have = memory_limit(), 0
    try:
        with bz2.open(source) as unpacked:
            while piece := unpacked.read(CHUNK_BYTES):
                have += len(piece)
                if have > limit:
                    raise UserError(f"{path} unpacks to more than {limit:,} bytes")
                target.write(piece)
    except (EOFError, OSError) as error:
        raise UserError(f"{path} is cut off or damaged: {error}") from error


def _with_points(path: Path, line: bytes, axes: int) -> bytes:
    """Write a line's numbers with points where they have decimal commas."""
    match = _NUMBERS.match(line)
    if match is None or b"," not in line:
        return line
    name, numbers = line[: match.end()], line[match.end() :]
    if b"(" not in numbers:
        return name + _COMMA.sub(b".", numbers)
    return name + _VECTOR.sub(lambda found: _vector(path, found[1], axes), numbers)


def _vector(path: Path, inside: bytes, axes: int) -> bytes:
    """Write one vector; of twice as many numbers each second one is a fraction."""
    parts = [part.strip() for part in inside.split(b",")]
    if b"." in inside or len(parts) == axes:
        return b"(" + inside + b")"
    if b";" in inside:
        return b"(" + inside.replace(b",", b".").replace(b";", b",") + b")"
    if len(parts) == 2 * axes and all(part.isdigit() for part in parts[1::2]):
        pairs = zip(parts[::2], parts[1::2], strict=True)
        return b"(" + b",".join(whole + b"." + part for whole, part in pairs) + b")"
    raise UserError(
        f"{path} has numbers with decimal commas, {inside.decode('utf-8', 'replace')}, "
        "which can be read in more than one way; write them with points"
    )


def _values(path: Path, lines: list[bytes]) -> tuple[Path, list[bytes]]:
    """Return where the values are, and the header of a file that holds both."""
    for n, line in enumerate(lines):
        match = _DATA_FILE.match(line)
        name = match[2].decode("utf-8", "replace").strip() if match else "LOCAL"
        if match is None or name.upper() == "LOCAL":
            continue
        if name.upper().startswith("LIST") or "%" in name:
            raise UserError(
                f"{path} has several files of values in a form that cannot be read; "
                "save it as one file, .nrrd or .mha"
            )
        local = [] if line.lower().startswith(b"data") else [match[1] + b"LOCAL"]
        return path.parent / name, [*lines[:n], *local, *lines[n + 1 :]]
    return path, lines
