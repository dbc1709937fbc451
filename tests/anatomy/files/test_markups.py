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
    with pytest.raises(ValueError, match=r"theirs.*must be in LPS, got RAS"):
        read_markups(file)
    file.write_text("[]")
    with pytest.raises(ValueError, match=r"theirs\.mrk\.json, line 1, .* a markups"):
        read_markups(file)
