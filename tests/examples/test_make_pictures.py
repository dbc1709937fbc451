"""The gallery's script draws one view by everything there is, and tells the truth."""

import re
import runpy
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from benchmarks import nasal_views
from benchmarks.gallery.contact_sheet import GAP_PX, HEAD_PX, NAME_PX
from benchmarks.gallery.gallery_views import gallery_scene, gallery_views
from renderers.scene import Scene
from tests.benchmarks.conftest import coarse_nasal_scene

__all__ = ["coarse_nasal_scene"]

EXAMPLE = Path(__file__).parents[2] / "examples" / "make_pictures.py"
VIEW = "wound"


@pytest.fixture
def script() -> Any:
    return runpy.run_path(str(EXAMPLE))["main"]


@pytest.fixture
def coarse(
    monkeypatch: pytest.MonkeyPatch, coarse_nasal_scene: Callable[[str], Scene]
) -> Iterator[None]:
    monkeypatch.setattr(nasal_views, "nasal_scene", coarse_nasal_scene)
    monkeypatch.setattr("benchmarks.light_witness.nasal_scene", coarse_nasal_scene)
    gallery_scene.cache_clear()
    yield
    gallery_scene.cache_clear()


def test_there_are_twelve_views_wounds_among_them() -> None:
    views = gallery_views(32)
    assert len(views) == len({view.name for view in views}) == 12
    assert [view.head for view in views].count("wounded") == 4


@pytest.mark.slow
def test_one_view_by_everything(tmp_path: Path, coarse: None, script: Any) -> None:
    assert (
        script(["gallery", "--views", VIEW, "--size", "32", "--out", str(tmp_path)])
        == 0
    )
    page = (tmp_path / "gallery.md").read_text()
    assert sorted(f.suffix for f in tmp_path.rglob("*") if f.is_file()) == [
        ".md",
        *[".png"] * 5,
    ]
    errors = figures(page)
    sheets = re.findall(r"\]\((pictures/\w+\.png)\)", page)
    assert len(errors) == len(sheets) == 5
    for name, row in zip(sheets, errors, strict=True):
        sheet = np.asarray(Image.open(tmp_path / name).convert("RGB"))
        for number, (who, error) in enumerate(row.items()):
            left = NAME_PX + number * (112 + GAP_PX)
            picture = sheet[HEAD_PX : HEAD_PX + 112, left : left + 112]
            if error is not None:
                # a picture of something, not an even patch
                assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 5, who
        *others, last = row.values()
        assert last == 0.0
        assert all(error is None or error > 0 for error in others)
    for row in errors[2:4]:
        fine = [row[f"ART {name}"] or 0.0 for name in ("preview", "snapshot", "final")]
        assert fine == sorted(fine, reverse=True)
    light = errors[1]
    dark, quick = light["ring, no bounce"], light["ring, virtual lights"]
    assert dark is not None
    assert quick is not None
    assert quick < dark


def figures(page: str) -> list[dict[str, float | None]]:
    """Return each family's errors of the one view; None where a peer is absent."""
    found = []
    lines = page.splitlines()
    for number, line in enumerate(lines):
        if line.startswith("| CPU time; error; SSIM"):
            heads = [c.strip() for c in line.strip("|").split("|")][1:]
            cells = [c.strip() for c in lines[number + 2].strip("|").split("|")][1:]
            found.append(
                {
                    who: None if cell == "absent" else float(cell.split("; ")[1])
                    for who, cell in zip(heads, cells, strict=True)
                }
            )
    return found


def test_ctrl_c_leaves_nothing(
    tmp_path: Path, script: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*words: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setitem(script.__globals__, "gallery_sheets", stopped)
    target = tmp_path / "new"
    assert script(["gallery", "--out", str(target)]) == 130
    assert not target.exists()


@pytest.mark.parametrize(
    "words", [["--views", "nowhere"], ["--size", "31"], ["--size", "33"]]
)
def test_bad_words_are_one_sentence(
    words: list[str], script: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        script(["gallery", *words])
    assert stopped.value.code == 2
    assert words[1].strip() in capsys.readouterr().err
