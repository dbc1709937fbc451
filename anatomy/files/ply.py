"""PLY, the polygon format of Turk (1994): triangles in, triangles out."""

import numpy as np
from numpy.typing import NDArray

from disk import UserError

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip

_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "ascii"}

MOST_HEADER_BYTES = 65_536

Content = tuple[NDArray[np.float64], NDArray[np.int32], str]


def ply_bytes(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], comment: str
) -> bytes:
    """Encode triangles, little-endian, coordinates as doubles."""
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment {comment}\n"
        f"element vertex {len(vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    records = np.empty(len(faces), [("n", "u1"), ("v", "<i4", 3)])
    records["n"], records["v"] = 3, faces
    return header.encode() + vertices.astype("<f8").tobytes() + records.tobytes()


def read_ply(content: bytes) -> Content:
    """Decode triangles; gives points, triangles and the space it names, or LPS.

    Raise ValueError for what is no PLY, is cut off or has faces of other than three
    corners.
    """
    end = content.find(b"end_header", 0, MOST_HEADER_BYTES)
    if not content.startswith(b"ply") or end < 0:
        raise UserError("it has no PLY header")
    body = content[content.index(b"\n", end) + 1 :]
    order, space = "", "LPS"
    elements: list[tuple[str, int, list[list[str]]]] = []
    for line in content[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        match words:
            case ["format", name, _]:
                order = _ORDERS.get(name, "")
            case ["comment", *rest] if "".join(rest).startswith("SPACE="):
                space = "".join(rest)[6:]
            case ["element", name, count]:
                elements.append((name, _count(count), []))
            case ["property", *rest] if elements:
                elements[-1][2].append(rest)
    names = [name for name, _, _ in elements]
    if not order or names[:1] != ["vertex"] or "face" not in names[1:2]:
        raise UserError("it must hold vertices and then faces")
    if order == "ascii":
        vertices, faces = _ascii(body, elements)
    else:
        vertices, faces = _binary(body, elements, order)
    return vertices, faces, space


def _count(word: str) -> int:
    if not (word.isascii() and word.isdigit()):
        raise UserError(f"it counts {word!r} elements")
    return int(word)


def _columns(properties: list[list[str]]) -> list[str]:
    names = [words[-1] for words in properties]
    known = all(len(words) == 2 and words[0] in _TYPES for words in properties)
    if not known or any(axis not in names for axis in "xyz"):
        raise UserError("its vertices need x, y and z")
    return names


def _binary(
    body: bytes, elements: list[tuple[str, int, list[list[str]]]], order: str
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    (_, points, columns), (_, triangles, lists) = elements[:2]
    _columns(columns)
    row = np.dtype([(name, order + _TYPES[kind]) for kind, name in columns])
    if len(lists) != 1 or lists[0][0] != "list" or len(lists[0]) != 4:
        raise UserError("its faces need one list of points each")
    _, count_kind, index_kind, _ = lists[0]
    if count_kind not in _TYPES or index_kind not in _TYPES:
        raise UserError("its faces have unknown types")
    corner = np.dtype(
        [("n", order + _TYPES[count_kind]), ("v", order + _TYPES[index_kind], 3)]
    )
    need = points * row.itemsize + triangles * corner.itemsize
    if len(body) < need:
        raise UserError(f"it is cut off: {len(body):,} of {need:,} bytes are there")
    table = np.frombuffer(body, row, points)
    vertices = np.stack([table[axis].astype(np.float64) for axis in "xyz"], axis=1)
    records = np.frombuffer(body, corner, triangles, points * row.itemsize)
    if (records["n"] != 3).any():
        raise UserError("it has faces that are no triangles")
    return vertices, records["v"].astype(np.int32)


def _ascii(
    body: bytes, elements: list[tuple[str, int, list[list[str]]]]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    (_, points, columns), (_, triangles, _) = elements[:2]
    names = _columns(columns)
    lines = body.decode("ascii", "replace").splitlines()
    if len(lines) < points + triangles:
        raise UserError(f"it is cut off after {len(lines):,} lines")
    rows = [line.split() for line in lines[: points + triangles]]
    if any(len(words) < len(names) for words in rows[:points]) or any(
        words[:1] != ["3"] or len(words) < 4 for words in rows[points:]
    ):
        raise UserError("it has short lines, or faces that are no triangles")
    at = [names.index(axis) for axis in "xyz"]
    vertices = np.array([[float(words[i]) for i in at] for words in rows[:points]])
    faces = [[int(word) for word in words[1:4]] for words in rows[points:]]
    return vertices.reshape(-1, 3), np.array(faces, np.int32).reshape(-1, 3)
