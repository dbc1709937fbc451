"""PLY and STL as other programs write them: the same cube, however it is written."""

import struct
from pathlib import Path

import numpy as np
import pytest

from anatomy.files.surfaces import load_surface

POINTS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1],
     [0, 1, 1]], float,
)  # fmt: skip
SQUARES = [
    [0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7],
]  # fmt: skip
TRIANGLES = [three for a, b, c, d in SQUARES for three in ([a, b, c], [a, c, d])]
MIXED = [SQUARES[0], *TRIANGLES[2:6], *SQUARES[3:]]
FORMATS = "ascii", "binary_little_endian", "binary_big_endian"


def ply(polygons: list[list[int]], kind: str, ends: str = "\n") -> bytes:
    """Write the cube with a colour at each point, and a number at each polygon."""
    lines = [
        "ply", f"format {kind} 1.0", "comment of somebody", "element vertex 8",
        "property float x", "property float y", "property float z",
        "property uchar red", f"element face {len(polygons)}",
        "property short material", "property list uchar int vertex_indices",
        "end_header", "",
    ]  # fmt: skip
    head = ends.join(lines).encode()
    if kind == "ascii":
        rows = [[*point, 7] for point in POINTS]
        rows += [[3, len(corners), *corners] for corners in polygons]
        return head + ends.join(" ".join(map(str, row)) for row in rows).encode()
    order = "<" if "little" in kind else ">"
    points = b"".join(struct.pack(f"{order}3fB", *point, 7) for point in POINTS)
    return head + points + b"".join(
        struct.pack(f"{order}hB{len(corners)}i", 3, len(corners), *corners)
        for corners in polygons
    )  # fmt: skip


def text_stl(ends: str = "\n", closing: str = "endsolid") -> bytes:
    lines = ["solid cube"]
    for three in TRIANGLES:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x:g} {y:g} {z:g}" for x, y, z in POINTS[three]]
        lines += ["endloop", "endfacet"]
    return ends.join([*lines, f"{closing} cube", ""]).encode()


def packed_stl(name: bytes = b"", behind: bytes = b"") -> bytes:
    facets = b"".join(
        struct.pack("<12fH", 0, 0, 0, *POINTS[three].ravel(), 0) for three in TRIANGLES
    )
    return name.ljust(80) + struct.pack("<I", len(TRIANGLES)) + facets + behind


def check(file: Path, content: bytes) -> None:
    """Read a cube whose sides look outwards, and whose volume is one."""
    file.write_bytes(content)
    surface = load_surface(file)
    assert len(surface.vertices) == 8
    a, b, c = (surface.vertices[surface.faces[:, n]] for n in range(3))
    assert np.einsum("ij,ij", a, np.cross(b, c)) / 6 == pytest.approx(1.0)


@pytest.mark.parametrize("polygons", [TRIANGLES, SQUARES, MIXED])
@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
def test_a_ply_is_read_whatever_its_polygons_and_lines(
    tmp_path: Path, polygons: list[list[int]], kind: str, ends: str
) -> None:
    check(tmp_path / "a.ply", ply(polygons, kind, ends))


@pytest.mark.parametrize(
    "content",
    [
        text_stl(),
        text_stl("\r"),
        text_stl("\r\n"),
        text_stl(closing="end solid"),
        text_stl().upper(),
        packed_stl(),
        packed_stl(b"solid by a program that writes bytes"),
        packed_stl(behind=b"\0\0a remark"),
    ],
)
def test_an_stl_is_read_whatever_stands_about_it(
    tmp_path: Path, content: bytes
) -> None:
    check(tmp_path / "a.stl", content)


@pytest.mark.parametrize("kind", FORMATS)
def test_a_ply_that_is_cut_off_is_told(tmp_path: Path, kind: str) -> None:
    content = ply(MIXED, kind)
    start = content.index(b"end_header") + 11
    for size in range(start, len(content) - 1, 7):
        (tmp_path / "a.ply").write_bytes(content[:size])
        with pytest.raises(ValueError, match=r"a\.ply cannot be read"):
            load_surface(tmp_path / "a.ply")


@pytest.mark.parametrize("content", [text_stl()[:-40], packed_stl()[:-3]])
def test_an_stl_that_is_cut_off_is_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.stl").write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.stl cannot be read"):
        load_surface(tmp_path / "a.stl")


def test_a_list_without_an_end_takes_no_memory(tmp_path: Path) -> None:
    content = ply(TRIANGLES, FORMATS[1]).replace(b"list uchar int", b"list uint int")
    (tmp_path / "a.ply").write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.ply cannot be read"):
        load_surface(tmp_path / "a.ply")
