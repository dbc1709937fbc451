from pathlib import Path

import pytest

from system import require_place


def test_a_place_is_only_looked_at(tmp_path: Path) -> None:
    require_place(tmp_path / "a.png")
    require_place(tmp_path / "new" / "deep" / "a.png")
    (tmp_path / "old.png").write_text("old", "utf-8")
    require_place(tmp_path / "old.png")
    assert [p.name for p in tmp_path.iterdir()] == ["old.png"]
    assert (tmp_path / "old.png").read_text("utf-8") == "old"


def test_a_relative_place_is_of_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    require_place(Path("a.png"))


@pytest.mark.parametrize("name", ["file/a.png", "file/new/a.png", "folder"])
def test_where_no_file_can_be_the_name_is_told(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("x", "utf-8")
    (tmp_path / "folder").mkdir()
    path = tmp_path / name
    with pytest.raises(OSError, match=r"directory") as caught:
        require_place(path)
    assert caught.value.filename == str(path)


def test_a_disk_that_refuses_is_told() -> None:
    with pytest.raises(OSError, match=r"/proc/picture\.png"):
        require_place(Path("/proc/picture.png"))
