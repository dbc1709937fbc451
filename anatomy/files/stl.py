"""STL, the format of 3-D printers: bare triangles, binary or as text."""

import numpy as np
from numpy.typing import NDArray

from disk import UserError

Content = tuple[NDArray[np.float64], NDArray[np.int32], str]

_HEADER_BYTES = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])


def stl_bytes(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], comment: str
) -> bytes:
    """Encode triangles as binary STL, in float32, which is all that it knows.

    vertices: ``(n, 3)``. faces: ``(m, 3)``, counter-clockwise seen from outside.
    comment: for the header; 80 ASCII characters at most, the first word no "solid".
    """
    records = np.zeros(len(faces), _RECORD)
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    records["normal"] = np.divide(across, length, out=across, where=length > 0)
    records["corners"] = corners
    head = comment.encode("ascii").ljust(80)
    return head + np.array(len(faces), "<u4").tobytes() + records.tobytes()


def read_stl(content: bytes) -> Content:
    """Decode triangles, joining equal corners; gives also the space, or LPS.

    3D Slicer writes ``SPACE=...`` into the header. Raise ValueError for what is no
    STL.
    """
    head = content[:80].decode("ascii", "replace")
    space = head.partition("SPACE=")[2][:3] or "LPS"
    count = (
        int(np.frombuffer(content, "<u4", 1, 80)[0])
        if len(content) >= _HEADER_BYTES
        else -1
    )
    if count >= 0 and len(content) == _HEADER_BYTES + count * _RECORD.itemsize:
        records = np.frombuffer(content, _RECORD, count, _HEADER_BYTES)
        corners = records["corners"].reshape(-1, 3).astype(np.float64)
    elif head.lstrip().startswith("solid"):
        words = [
            line.split()[1:]
            for line in content.decode("ascii", "replace").splitlines()
            if line.split()[:1] == ["vertex"]
        ]
        if len(words) % 3 or any(len(row) != 3 for row in words):
            raise UserError("it is cut off in the middle of a triangle")
        corners = np.array([[float(w) for w in row] for row in words], np.float64)
    else:
        raise UserError("it is no STL, or cut off")
    if not len(corners):
        raise UserError("it has no triangles")
    vertices, faces = np.unique(corners, axis=0, return_inverse=True)
    return vertices, faces.reshape(-1, 3).astype(np.int32), space
