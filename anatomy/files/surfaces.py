"""Triangle surfaces in the files that other programs read: PLY, VTP and STL.

trimesh writes STL. It writes PLY in float32, which would round positions, and reads
neither PLY of mixed polygons nor STL with bytes behind its triangles, so those are
ours; and so are those of VTP, because a number in the head of a damaged file makes
VTK's reader end the process.

Every file that is written says ``SPACE=LPS`` where 3D Slicer looks for it: in a comment
of PLY, in the header of STL, in the field data of VTP. A file that says RAS is turned,
one that says nothing is taken for LPS, as Slicer takes it.
"""

import base64
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from anatomy.files.ply import read_ply
from anatomy.files.volumes import write_file
from system import UserError, foreign_file

SPACES = ("LPS", "RAS")

Content = tuple[NDArray[np.float64], NDArray[np.int32], str]
"""Points, triangles, and the space that the file names, or LPS."""

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_END_FACET = re.compile(rb"end\s*facet", re.IGNORECASE)


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles. vertices: ``(n, 3)`` float64 LPS mm; faces: ``(m, 3)`` int32."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        faces = np.ascontiguousarray(self.faces, dtype=np.int32)
        if vertices.ndim != 2 or vertices.shape[1:] != (3,) or not len(vertices):
            raise UserError(f"a surface has points (n, 3), got {vertices.shape}")
        if faces.ndim != 2 or faces.shape[1:] != (3,):
            raise UserError(f"a surface has triangles (m, 3), got {faces.shape}")
        if not np.isfinite(vertices).all():
            raise UserError("a surface's points must be finite")
        if len(faces) and not (faces.min() >= 0 and faces.max() < len(vertices)):
            raise UserError(
                f"triangles name points from {faces.min()} to {faces.max()}, but there "
                f"are {len(vertices)}"
            )
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)

    def middles(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return each triangle's middle and unit normal, ``(m, 3)``; NaN of a flat one.

        The normal is right-handed about the triangle's corners.
        """
        corners = self.vertices[self.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        with np.errstate(invalid="ignore"):
            normals /= np.linalg.norm(normals, axis=1)[:, None]
        return corners.mean(axis=1), normals

    def moved(self, transform: NDArray[np.float64]) -> "Surface":
        """Return the surface under a 4x4 transform."""
        turned = self.vertices @ transform[:3, :3].T + transform[:3, 3]
        return Surface(turned, self.faces)


def save_surface(
    surface: Surface,
    path: Path | str,
    cells: Mapping[str, NDArray[np.float64]] | None = None,
) -> None:
    """Write a surface, atomically, as PLY, VTP or STL.

    cells: values of triangles, ``(m,)`` by name, which only a VTP holds.
    Every coordinate keeps its bits in PLY and VTP; STL has float32 and bare triangles.
    """
    target = Path(path)
    if cells and target.suffix.lower() != ".vtp":
        raise UserError(f"{target} must end in .vtp: only that holds values.")
    match target.suffix.lower():
        case ".ply":
            content = _ply_bytes(surface)
        case ".vtp":
            content = _vtp_bytes(surface, cells or {})
        case ".stl":
            content = _stl_bytes(surface)
        case other:
            raise UserError(
                f"{target} must end in .ply, .vtp or .stl, got {other or 'no ending'}"
            )
    write_file(target, content)


def load_surface(path: Path | str) -> Surface:
    """Read a surface from PLY, STL, or a VTP as `save_surface` writes it; in LPS.

    Raise UserError, in one sentence naming the file, for anything else or a damaged
    file.
    """
    source = Path(path)
    if not source.is_file():
        raise UserError(f"there is no surface file {source}")
    with foreign_file(source, "a surface"):
        match source.suffix.lower():
            case ".ply":
                vertices, faces, space = read_ply(source.read_bytes())
            case ".stl":
                vertices, faces, space = _read_stl(source.read_bytes())
            case ".vtp":
                vertices, faces, space = _read_vtp(source.read_bytes())
            case _:
                raise UserError("PLY, STL and VTP can be read")
        if space not in SPACES:
            raise UserError(f"its space is {space!r}; LPS and RAS are known")
        if space == "RAS":
            vertices = vertices * (-1.0, -1.0, 1.0)
        return Surface(vertices, faces)


def _ply_bytes(surface: Surface) -> bytes:
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment SPACE=LPS\n"
        f"element vertex {len(surface.vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(surface.faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    records = np.empty(len(surface.faces), [("n", "u1"), ("v", "<i4", 3)])
    records["n"], records["v"] = 3, surface.faces
    return (
        header.encode() + surface.vertices.astype("<f8").tobytes() + records.tobytes()
    )


def _stl_bytes(surface: Surface) -> bytes:
    import trimesh

    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    # the header's 80 bytes say nothing else
    return b"SPACE=LPS".ljust(80) + trimesh.exchange.stl.export_stl(mesh)[80:]


def _read_stl(content: bytes) -> Content:
    """Read an STL of bytes or of text, whatever follows its triangles."""
    # 3D Slicer writes the space into the header
    found = re.search(rb"SPACE=(\w{3})", content[:80])
    space = found[1].decode() if found else "LPS"
    count = int.from_bytes(content[80:84], "little")
    records = content[84 : 84 + count * _FACET.itemsize]
    if count and len(records) == count * _FACET.itemsize:
        corners = np.frombuffer(records, _FACET)["corners"].reshape(-1, 3)
    else:
        # text that began so would count half a thousand million triangles
        numbers = np.array(_VERTEX.findall(content), np.float64).reshape(-1, 3)
        if len(numbers) != 3 * len(_END_FACET.findall(content)):
            raise UserError("it is cut off")
        corners = numbers
    if not len(corners):
        raise UserError("it has no triangles")
    vertices, faces = np.unique(corners.astype(np.float64), axis=0, return_inverse=True)
    return vertices, faces.reshape(-1, 3).astype(np.int32), space


def _vtp_bytes(surface: Surface, cells: Mapping[str, NDArray[np.float64]]) -> bytes:
    count, triangles = len(surface.vertices), len(surface.faces)
    offsets = 3 * np.arange(1, triangles + 1, dtype="<i8")
    arrays = "".join(
        f'<DataArray type="Float64" Name="{name}" format="binary">\n'
        f"{_encoded(np.ascontiguousarray(values, '<f8'))}\n</DataArray>"
        for name, values in cells.items()
    )
    painted = f"<CellData>{arrays}</CellData>\n" if cells else ""
    letters = " ".join(str(ord(c)) for c in "LPS\0")
    text = f"""<?xml version="1.0"?>
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData>
<FieldData><Array type="String" Name="SPACE" NumberOfTuples="1" format="ascii">
{letters}
</Array></FieldData>
<Piece NumberOfPoints="{count}" NumberOfVerts="0" NumberOfLines="0" \
NumberOfStrips="0" NumberOfPolys="{triangles}">
<Points><DataArray type="Float64" Name="Points" NumberOfComponents="3" format="binary">
{_encoded(surface.vertices.astype("<f8"))}
</DataArray></Points>
<Polys><DataArray type="Int64" Name="connectivity" format="binary">
{_encoded(surface.faces.astype("<i8"))}
</DataArray><DataArray type="Int64" Name="offsets" format="binary">
{_encoded(offsets)}
</DataArray></Polys>
{painted}</Piece>
</PolyData>
</VTKFile>
"""
    return text.encode("ascii")


def _encoded(values: NDArray[np.generic]) -> str:
    raw = values.tobytes()
    return base64.b64encode(np.array([len(raw)], "<u8").tobytes() + raw).decode()


def _read_vtp(content: bytes) -> Content:
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise UserError("a VTP declares no entities")
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise UserError(f"it is no XML ({error})") from error
    if root.get("type") != "PolyData" or root.get("header_type") != "UInt64":
        raise UserError("only VTP files with inline arrays and 64-bit sizes are known")
    space = "LPS"
    for array in root.iter("Array"):
        if array.get("Name") == "SPACE":
            codes = [int(word) for word in (array.text or "").split()]
            space = "".join(chr(code) for code in codes if 0 < code < 128)
    vertices = _decoded(root, "Points", "Float64", "<f8").reshape(-1, 3)
    faces = _decoded(root, "connectivity", "Int64", "<i8").reshape(-1, 3)
    offsets = _decoded(root, "offsets", "Int64", "<i8")
    if not np.array_equal(offsets, 3 * np.arange(1, len(faces) + 1)):
        raise UserError("it has polygons that are no triangles")
    return vertices, faces.astype(np.int32), space


def _decoded(
    root: ElementTree.Element, name: str, kind: str, dtype: str
) -> NDArray[np.float64]:
    for array in root.iter("DataArray"):
        if array.get("Name") != name:
            continue
        if array.get("type") != kind or array.get("format") != "binary":
            raise UserError(f"its {name} are no inline {kind}")
        raw = base64.b64decode("".join((array.text or "").split()), validate=True)
        size = int(np.frombuffer(raw[:8], "<u8")[0]) if len(raw) >= 8 else -1
        if size != len(raw) - 8 or size % (24 if name != "offsets" else 8):
            raise UserError(f"its {name} are cut off")
        values: NDArray[np.float64] = np.frombuffer(raw[8:], dtype).copy()
        return values
    raise UserError(f"it has no {name}")
