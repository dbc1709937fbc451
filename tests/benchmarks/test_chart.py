"""Every scene gets its picture, every series its points in order."""

from pathlib import Path

import msgspec
import numpy as np
from PIL import Image

from benchmarks.chart import draw_charts, panels
from benchmarks.schema import Row


def rows_of(row: Row, scene: str) -> list[Row]:
    return [
        msgspec.structs.replace(
            row,
            case=f"{scene}/{view}/{quantity}",
            mode=f"ART, step {step}",
            cpu_s=0.1 / step,
            rmse=step**2 / 100,
            settings=row.settings | {"step_voxels": step},
        )
        for view in ("inside", "outside")
        for quantity in ("wall", "shaded")
        for step in (0.25, 1.0, 0.5)
    ]


def test_points_run_from_coarse_to_fine(row: Row) -> None:
    found = panels(rows_of(row, "head"))
    assert set(found) == {
        (v, q) for v in ("inside", "outside") for q in ("wall", "shaded")
    }
    for series in found.values():
        assert [p.settings["step_voxels"] for p in series["ART"]] == [1.0, 0.5, 0.25]


def test_one_picture_for_each_scene(row: Row, tmp_path: Path) -> None:
    others = [
        msgspec.structs.replace(row, case="import", rmse=None),
        msgspec.structs.replace(row, case="nose/views/bounce"),
        msgspec.structs.replace(row, case="phantom/inside"),
        # measured for its time alone, it belongs to no curve
        msgspec.structs.replace(row, case="case/inside/wall", settings={"threads": 2}),
    ]
    files = draw_charts(
        [*rows_of(row, "head"), *rows_of(row, "phantom"), *others], tmp_path
    )
    assert {file.name for file in files} == {
        "head.png",
        "head.svg",
        "phantom.png",
        "phantom.svg",
    }
    assert set(tmp_path.iterdir()) == set(files)
    with Image.open(tmp_path / "head.png") as picture:
        pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    # the series' own red is drawn, not only axes and text
    red = np.abs(pixels.astype(int) - (0xB3, 0x32, 0x1F)).max(axis=1) < 8
    assert red.sum() > 200


def test_nothing_measured_draws_nothing(tmp_path: Path) -> None:
    assert draw_charts([], tmp_path) == []
    assert list(tmp_path.iterdir()) == []
