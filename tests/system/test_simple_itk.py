import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import SimpleITK

from anatomy.files.volumes import load_volume, save_volume
from devices.registration.registration_file import save_itk_transform
from paravol.snapshots.picture_files import save_depth_nrrd
from renderers.scene import Volume
from tests.comma_locale import comma, germany

__all__ = ["comma", "germany"]

ROOT = Path(__file__).parents[2]
SOURCES = (
    *("anatomy", "app", "devices", "system", "paravol", "renderers"),
    *("scenarios", "surgery"),
)


@pytest.mark.parametrize("ending", ["nrrd", "nii.gz", "mha"])
def test_a_volume_keeps_its_place_where_the_decimal_is_a_comma(
    ending: str, tmp_path: Path, comma: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exact: all these numbers are sums of few powers of two."""
    spacing, origin = np.array([1.5, 1.25, 0.75]), np.array([-12.5, 3.25, 7.125])
    values = np.arange(60, dtype=np.int16).reshape(3, 4, 5)
    made = Volume(values, spacing, origin, background=0)
    save_volume(made, tmp_path / f"made.{ending}")
    again = load_volume(tmp_path / f"made.{ending}")
    assert np.array_equal(again.values, values)
    assert np.array_equal(again.spacing_mm, spacing)
    assert np.array_equal(again.origin_mm, origin)


def test_a_depth_and_a_transform_are_written_with_points(
    tmp_path: Path, comma: None
) -> None:
    save_depth_nrrd(tmp_path / "depth.nrrd", np.full((2, 3), 1.5, np.float32))
    matrix = np.eye(4)
    matrix[:3, 3] = 1.5, -2.25, 0.125
    save_itk_transform(tmp_path / "place.tfm", matrix)
    text = (tmp_path / "place.tfm").read_text()
    assert "-1.5 2.25 -0.125" in text
    assert "," not in text
    depth: Any = SimpleITK.ReadImage(tmp_path / "depth.nrrd")
    assert depth.GetPixel(2, 1) == 1.5


def test_no_other_module_asks_for_the_library() -> None:
    asked = [
        path.relative_to(ROOT).as_posix()
        for folder in SOURCES
        for path in (ROOT / folder).rglob("*.py")
        if "SimpleITK" in (text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant | ast.Import | ast.ImportFrom)
        and "SimpleITK" in _asked(node)
    ]
    assert asked == ["system/simple_itk.py"]


def _asked(node: ast.Constant | ast.Import | ast.ImportFrom) -> list[str]:
    if isinstance(node, ast.Constant):
        return [str(node.value)]
    if isinstance(node, ast.ImportFrom):
        return [str(node.module)]
    return [alias.name for alias in node.names]
