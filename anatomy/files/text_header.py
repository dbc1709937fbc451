"""Headers of text as other programs write them, for a reader that knows fewer of them.

ITK knows no bzip2, no lengths but millimetres, and reads a decimal comma as an end.
"""

import bz2
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from disk import UserError
from renderers.scene.memory_limit import memory_limit

LONGEST_HEADER = 1 << 20

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
_RAW = re.compile(rb"^encoding:.*", re.IGNORECASE)
_VECTOR = re.compile(rb"\(([^()]*)\)")
_COMMA = re.compile(rb"(?<=\d),(?=\d)")
_QUOTED = re.compile(r'"([^"]*)"')


def units_mm(path: Path) -> tuple[NDArray[np.float64], list[str]]:
    """Return the millimetres of a unit along each axis of space, ``(3,)``, and notes.

    Raises UserError for a unit that is no length.
    """
    fields = _fields(path)
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
def readable_copy(path: Path) -> Iterator[Path]:
    """Give the file itself, or a copy for a while that ITK can read.

    Raises UserError for numbers with commas that can be read in two ways, and for
    values that unpack to more than memory holds.
    """
    head, rest = _parted(path)
    lines = head.splitlines()
    fields = _fields(path)
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
    is_nrrd = head.startswith(b"NRRD")
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / f"volume{'.nrrd' if is_nrrd else '.mha'}"
        with values.open("rb") as source, copy.open("wb") as target:
            target.write(b"\n".join(changed) + (b"\n\n" if is_nrrd else b"\n"))
            source.seek(rest if values == path else 0)
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


def _parted(path: Path) -> tuple[bytes, int]:
    """Return the lines of a header, and where the values begin."""
    with path.open("rb") as file:
        head = file.read(LONGEST_HEADER)
    if head.startswith(b"NRRD"):
        end = re.search(rb"\r?\n\r?\n", head)
    else:
        end = re.search(rb"ElementDataFile[^\n]*\n", head)
        if end is not None:
            return head[: end.end()], end.end()
    return (head, len(head)) if end is None else (head[: end.start()], end.end())


def _fields(path: Path) -> dict[str, str]:
    """Return a header's fields, by their names in small letters."""
    found = {}
    for line in _parted(path)[0].decode("utf-8", "replace").splitlines():
        key, separator, value = line.partition(":" if ":" in line else "=")
        if separator and not value.startswith("="):
            found[key.strip().lower()] = value.strip()
    return found


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
