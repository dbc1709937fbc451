"""Surfaces of an asymmetric head, written, read back, and read by others."""

from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from anatomy.files.surfaces import Surface, load_surface, save_surface
from system import UserError

ENDINGS = ["ply", "vtp"]


def letter(
    place: float, strokes: list[tuple[int, ...]]
) -> tuple[list[list[float]], list[list[int]]]:
    """Give a letter of flat strokes, drawn facing the viewer in front of the face."""
    points: list[list[float]] = []
    faces: list[list[int]] = []
    for x0, z0, x1, z1 in strokes:
        n = len(points)
        points += [
            [place + x, -80.0, z] for x, z in ((x0, z0), (x1, z0), (x1, z1), (x0, z1))
        ]
        faces += [[n, n + 1, n + 2], [n, n + 2, n + 3]]
    return points, faces


def lettered_head() -> Surface:
    """An L near the patient's left and, larger, the upright of an R near the right."""
    left, left_faces = letter(40.0, [(0, 0, 2, 20), (2, 0, 10, 2)])
    right, right_faces = letter(
        -40.0, [(0, 0, 2, 30), (-8, 28, 0, 30), (-8, 16, 0, 18)]
    )
    faces = np.array(left_faces + (np.array(right_faces) + len(left)).tolist())
    # coordinates without a short binary form
    return Surface(np.array(left + right) + 1 / 3, faces)


@pytest.mark.parametrize("ending", ENDINGS)
def test_every_bit_comes_back(tmp_path: Path, ending: str) -> None:
    head = lettered_head()
    save_surface(head, tmp_path / f"head.{ending}")
    again = load_surface(tmp_path / f"head.{ending}")
    assert again.vertices.tobytes() == head.vertices.tobytes()
    assert again.faces.tobytes() == head.faces.tobytes()
    assert [p.name for p in tmp_path.iterdir()] == [f"head.{ending}"]


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    points=arrays(np.float64, (5, 3), elements=st.floats(-1e9, 1e9)),
    faces=arrays(np.int32, (4, 3), elements=st.integers(0, 4)),
    ending=st.sampled_from(ENDINGS),
)
def test_any_surface_comes_back(
    tmp_path: Path, points: np.ndarray, faces: np.ndarray, ending: str
) -> None:
    surface = Surface(points, faces)
    save_surface(surface, tmp_path / f"s.{ending}")
    again = load_surface(tmp_path / f"s.{ending}")
    assert again.vertices.tobytes() == surface.vertices.tobytes()
    assert np.array_equal(again.faces, faces)


@pytest.mark.parametrize("ending", ENDINGS)
def test_others_read_left_on_the_left(tmp_path: Path, ending: str) -> None:
    head = lettered_head()
    save_surface(head, tmp_path / f"head.{ending}")
    mesh = pv.read(tmp_path / f"head.{ending}")
    tolerance = 0 if ending == "vtp" else 1e-4
    assert np.abs(np.asarray(mesh.points) - head.vertices).max() <= tolerance
    assert np.array_equal(mesh.regular_faces, head.faces)
    tall = np.asarray(mesh.points)[:, 2] > 25
    # only the R, on the patient's right, is as tall
    assert (np.asarray(mesh.points)[tall, 0] < 0).all()
    if ending == "vtp":
        assert list(mesh.field_data["SPACE"]) == ["LPS"]
    else:
        assert b"comment SPACE=LPS" in (tmp_path / "head.ply").read_bytes()


def test_stl_keeps_every_triangle_and_its_side(tmp_path: Path) -> None:
    head = lettered_head()
    save_surface(head, tmp_path / "head.stl")
    again = load_surface(tmp_path / "head.stl")
    mine = head.vertices[head.faces].astype(np.float32)
    assert np.array_equal(again.vertices[again.faces], mine.astype(np.float64))
    theirs = pv.read(tmp_path / "head.stl")
    found = np.asarray(theirs.points)[theirs.regular_faces]
    assert np.array_equal(found, mine)
    records = np.frombuffer(
        (tmp_path / "head.stl").read_bytes(),
        np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("extra", "<u2")]),
        offset=84,
    )
    across = np.cross(mine[:, 1] - mine[:, 0], mine[:, 2] - mine[:, 0])
    assert (np.einsum("ij,ij->i", records["normal"], across) > 0).all()
    assert np.allclose(np.linalg.norm(records["normal"], axis=1), 1.0, atol=1e-5)


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("ending", ["ply", "stl"])
def test_files_of_others_are_read(tmp_path: Path, ending: str, binary: bool) -> None:
    head = lettered_head()
    mesh = pv.PolyData.from_regular_faces(head.vertices, head.faces.astype(int))
    mesh.save(tmp_path / f"theirs.{ending}", binary=binary)
    again = load_surface(tmp_path / f"theirs.{ending}")
    mine = head.vertices[head.faces]
    theirs = again.vertices[again.faces]
    assert np.abs(theirs - mine).max() < 1e-4


def test_ras_is_turned(tmp_path: Path) -> None:
    head = lettered_head()
    save_surface(head, tmp_path / "head.ply")
    content = (tmp_path / "head.ply").read_bytes()
    (tmp_path / "ras.ply").write_bytes(content.replace(b"SPACE=LPS", b"SPACE=RAS"))
    turned = load_surface(tmp_path / "ras.ply")
    assert np.array_equal(turned.vertices, head.vertices * (-1, -1, 1))


@pytest.mark.parametrize("ending", ENDINGS)
def test_every_cut_is_noticed(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"head.{ending}"
    save_surface(lettered_head(), file)
    whole = file.read_bytes()
    for size in np.linspace(0, len(whole) - 20, 23).astype(int):
        file.write_bytes(whole[:size])
        with pytest.raises(ValueError, match=f"head.{ending} cannot be read"):
            load_surface(file)


def test_strange_files_are_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0")
    bomb = b'<!DOCTYPE x [<!ENTITY a "aaaa">]><VTKFile type="PolyData">&a;</VTKFile>'
    (tmp_path / "b.vtp").write_bytes(bomb)
    (tmp_path / "c.stl").write_bytes(b"\x00" * 84)
    for name, reason in (("a.obj", "PLY"), ("b.vtp", "entities"), ("c.stl", "no tri")):
        with pytest.raises(ValueError, match=rf"{name}.*{reason}"):
            load_surface(tmp_path / name)
    with pytest.raises(ValueError, match="no surface file"):
        load_surface(tmp_path / "d.ply")
    with pytest.raises(ValueError, match=r"must end in \.ply"):
        save_surface(lettered_head(), tmp_path / "e.obj")
    with pytest.raises(ValueError, match="from 0 to 9"):
        Surface(np.zeros((3, 3)), np.array([[0, 1, 9]]))


def test_values_of_triangles_are_read_by_others(tmp_path: Path) -> None:
    head = lettered_head()
    seconds = np.linspace(0.0, 1.0, len(head.faces))
    save_surface(head, tmp_path / "head.vtp", {"seconds_seen": seconds})
    mesh = pv.read(tmp_path / "head.vtp")
    assert np.array_equal(mesh.cell_data["seconds_seen"], seconds)
    again = load_surface(tmp_path / "head.vtp")
    assert np.array_equal(again.faces, head.faces)
    with pytest.raises(UserError, match="vtp"):
        save_surface(head, tmp_path / "head.ply", {"seconds_seen": seconds})
    middle, normals = head.middles()
    assert np.abs(normals[:, 1]).min() > 0.99
    assert np.allclose(middle[0], head.vertices[head.faces[0]].mean(axis=0))
