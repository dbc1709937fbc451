"""PLY surfaces as other programs write them: any polygons, any ends of lines.

A header lists elements and the properties of each; a property may be a list.
"""

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from system import UserError

MOST_HEADER_BYTES = 65_536
"""Bytes of a file in which its header must end."""

_KINDS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2",
    "int16": "i2", "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4",
    "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4", "double": "f8",
    "float64": "f8",
}  # fmt: skip

_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

_COUNT = " count"

_Read = dict[str, list[NDArray[Any]]]
"""Of each property, blocks of rows, ``(n, numbers)``."""

_LISTS = ("vertex_indices", "vertex_index")


@dataclass(slots=True)
class _Element:
    """An element. properties: name, kind, and the kind of a list's count or ""."""

    name: str
    count: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)


def read_ply(
    content: bytes,
) -> tuple[NDArray[np.float64], NDArray[np.int32], str]:
    """Return points ``(n, 3)``, triangles ``(m, 3)``, and the space that is named.

    Polygons are parted into triangles about their first point. Raises UserError for
    what is no PLY, or is cut off.
    """
    head, start = _header(content)
    order, elements = _elements(head)
    words = [] if order else [float(w) for w in reversed(content[start:].split())]
    vertices, faces, at = None, None, start
    for element in elements:
        if order:
            read, at = _from_bytes(element, content, at, order)
        else:
            read = _from_text(element, words)
        if element.name == "vertex" and element.count and {*"xyz"} <= read.keys():
            vertices = np.hstack([np.concatenate(read[axis]) for axis in "xyz"])
        for name in _LISTS:
            if element.name == "face" and name in read:
                faces = _triangles(read[name])
    if vertices is None or faces is None:
        raise UserError("it must hold vertices and faces")
    found = re.search(r"^comment\s+SPACE=(\w+)", head, re.MULTILINE)
    return vertices.astype(np.float64), faces, found[1] if found else "LPS"


def _header(content: bytes) -> tuple[str, int]:
    """Return the lines of the header, and where what follows begins."""
    end = content.find(b"end_header", 0, MOST_HEADER_BYTES)
    ends = re.match(rb"ply[ \t]*(\r\n|\n|\r)", content)
    if ends is None or end < 0:
        raise UserError("it has no PLY header")
    head = content[:end].decode("utf-8", "replace")
    start = content.index(ends[1], end) + len(ends[1])
    return head.replace("\r\n", "\n").replace("\r", "\n"), start


def _elements(head: str) -> tuple[str, list[_Element]]:
    order, elements = None, []
    for line in head.splitlines():
        match line.split():
            case ["format", name, *_]:
                order = _ORDERS.get(name)
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count)))
            case ["property", "list", count, kind, name] if elements:
                elements[-1].properties.append((name, _kind(kind), _kind(count)))
            case ["property", kind, name] if elements:
                elements[-1].properties.append((name, _kind(kind), ""))
    if order is None:
        raise UserError("it does not say how its numbers are written")
    return order, elements


def _kind(word: str) -> str:
    if word not in _KINDS:
        raise UserError(f"its header names numbers of kind {word!r}")
    return _KINDS[word]


def _from_text(element: _Element, words: list[float]) -> _Read:
    """Take an element's numbers off the end of a list that was turned about."""
    read: _Read = {name: [] for name, *_ in element.properties}
    try:
        for _ in range(element.count):
            for name, _, is_list in element.properties:
                count = int(words.pop()) if is_list else 1
                read[name].append(np.array([[words.pop() for _ in range(count)]]))
    except IndexError as error:
        raise UserError("it is cut off") from error
    return read


def _from_bytes(
    element: _Element, content: bytes, at: int, order: str
) -> tuple[_Read, int]:
    """Read an element; rows whose lists are as long as each other's go together."""
    read: _Read = {name: [] for name, *_ in element.properties}
    left = element.count if element.properties else 0
    while left:
        row = _row(element, content, at, order)
        whole = min(left, (len(content) - at) // row.itemsize)
        if not whole:
            raise UserError("it is cut off")
        rows = np.frombuffer(content, row, whole, at)
        lengths = [rows[n + _COUNT] for n, _, counted in element.properties if counted]
        differs = np.zeros(whole, bool)
        for length in lengths:
            differs |= length != length[0]
        run = int(np.argmax(differs)) if differs.any() else whole
        for name in read:
            read[name].append(rows[name][:run].reshape(run, -1))
        at, left = at + run * row.itemsize, left - run
    return read, at


def _row(element: _Element, content: bytes, at: int, order: str) -> np.dtype[np.void]:
    """Return what the row at a place is made of; its lists say how long they are."""
    fields: list[tuple[str, str, tuple[int, ...]]] = []
    for name, kind, counted in element.properties:
        count = 1
        if counted:
            where = at + np.dtype(fields).itemsize
            raw = content[where : where + int(counted[1])]
            if len(raw) < int(counted[1]):
                raise UserError("it is cut off")
            count = int(np.frombuffer(raw, order + counted)[0])
            if count < 0 or count * int(kind[1]) > len(content):
                raise UserError(f"it has a list of {count} numbers")
            fields.append((name + _COUNT, order + counted, ()))
        fields.append((name, order + kind, (count,)))
    return np.dtype(fields)


def _triangles(polygons: list[NDArray[Any]]) -> NDArray[np.int32]:
    """Part polygons, each ``(n, corners)``, about their first corners."""
    found = [np.zeros((0, 3), np.int32)]
    for corners in polygons:
        fans = [corners[:, [0, n, n + 1]] for n in range(1, corners.shape[1] - 1)]
        if fans:
            found.append(np.stack(fans, axis=1).reshape(-1, 3).astype(np.int32))
    return np.concatenate(found)
