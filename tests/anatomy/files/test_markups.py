from pathlib import Path

import numpy as np
import pytest

from anatomy.files.markups import read_markups, write_markups
from anatomy.queries.landmarks import Landmark
from anatomy.tissue import Side


def test_landmarks_come_back_with_their_sides(tmp_path: Path) -> None:
    marks = [
        Landmark("nostril", Side.LEFT, np.array([1 / 3, -2.5, 1e-9]), 4.0),
        Landmark("nostril", Side.RIGHT, np.array([-7.0, 0.1, 3.0]), 4.5),
        Landmark("nasion", Side.MIDLINE, np.array([0.0, 1.0, 2.0]), 1.0),
    ]
    file = tmp_path / "landmarks.mrk.json"
    write_markups({m.key: m for m in marks}, file)
    again = read_markups(file)
    assert list(again) == ["nostril, left", "nostril, right", "nasion"]
    for mark in marks:
        assert np.array_equal(again[mark.key].position_mm, mark.position_mm)
        assert again[mark.key].radius_mm == mark.radius_mm


def test_points_placed_in_another_program_are_welcome(tmp_path: Path) -> None:
    file = tmp_path / "theirs.mrk.json"
    file.write_text(
        '{"@schema": "x", "markups": [{"type": "Fiducial", "coordinateSystem": "LPS",'
        '"locked": true, "controlPoints": [{"id": "7", "label": "face 1",'
        '"description": "by hand", "position": [1, 2, 3], "selected": true}]}]}'
    )
    (mark,) = read_markups(file).values()
    assert mark.side is Side.MIDLINE
    assert mark.position_mm.tolist() == [1, 2, 3]
    file.write_text(file.read_text().replace("LPS", "RAS"))
    (mark,) = read_markups(file).values()
    assert mark.position_mm.tolist() == [-1, -2, 3]
    file.write_text(file.read_text().replace("RAS", "IJK"))
    with pytest.raises(ValueError, match=r"theirs.*must be in LPS or RAS, got IJK"):
        read_markups(file)
    file.write_text("[]")
    with pytest.raises(ValueError, match=r"theirs\.mrk\.json, line 1, .* a markups"):
        read_markups(file)


@pytest.mark.parametrize(
    "position",
    ['"position": ""', '"position": null', '"position": [1, 2, 3]', '"label": "x"'],
)
def test_a_point_that_nobody_placed_is_none(tmp_path: Path, position: str) -> None:
    """3D Slicer writes all points of a template, those to come included."""
    file = tmp_path / "theirs.mrk.json"
    file.write_text(
        '{"markups": [{"coordinateSystem": "LPS", "controlPoints": ['
        '{"position": [4, 5, 6], "positionStatus": "defined"},'
        f'{{"label": "to come", "positionStatus": "undefined", {position}}}]}}]}}'
    )
    (mark,) = read_markups(file).values()
    assert (mark.name, mark.position_mm.tolist()) == ("point 1", [4, 5, 6])


@pytest.mark.parametrize(
    ("system", "place"),
    [("LPS", [1, -2, 3]), ("1", [1, -2, 3]), ("RAS", [-1, 2, 3]), ("0", [-1, 2, 3]),
     (None, [-1, 2, 3])],
)  # fmt: skip
def test_the_older_list_of_points_is_read(
    tmp_path: Path, system: str | None, place: list[float]
) -> None:
    file = tmp_path / "points.fcsv"
    told = f"# CoordinateSystem = {system}\n" if system else ""
    file.write_text(
        f"# Markups fiducial file version = 4.11\n{told}"
        "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
        "1,1.0,-2.0,3.0,0,0,0,1,1,1,0,nasion,,\n"
        '2,1.5,-2.5,3.5,0,0,0,1,1,1,0,"left, upper",by hand,vtkMRML1\n'
    )
    marks = read_markups(file)
    assert list(marks) == ["nasion", "left, upper"]
    assert marks["nasion"].position_mm.tolist() == place
    file.write_text("1,one,2,3\n")
    with pytest.raises(ValueError, match=r"points\.fcsv cannot be read"):
        read_markups(file)
