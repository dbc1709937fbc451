import os
import time
from pathlib import Path

import numpy as np
import pytest

from renderers.scene.cache_entries import kept_entry, mark_used
from system import ForeignFileError, foreign_file


def keep(folder: Path, name: str, most: int = 3) -> Path:
    entry = folder / name
    with kept_entry(entry, most) as beside:
        beside.write_text(name)
    return entry


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def used_at(entry: Path, seconds_ago: float) -> None:
    then = time.time() - seconds_ago
    os.utime(entry, (then, then))


def test_those_not_used_for_longest_go(tmp_path: Path) -> None:
    for age, name in enumerate(("a.npz", "b.npz", "c.npz")):
        used_at(keep(tmp_path, name), 100.0 - age)
    mark_used(tmp_path / "a.npz")
    keep(tmp_path, "d.npz")
    assert names(tmp_path) == {"a.npz", "c.npz", "d.npz"}
    keep(tmp_path, "e.npz", most=1)
    assert names(tmp_path) == {"e.npz"}


def test_other_files_of_the_folder_stay(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    for name in ("a.npz", "b.npz"):
        keep(tmp_path, name, most=1)
    assert names(tmp_path) == {"notes.txt", "b.npz"}


def test_an_entry_that_fails_halfway_removes_none(tmp_path: Path) -> None:
    keep(tmp_path, "a.npz", most=1)

    def half() -> None:
        with kept_entry(tmp_path / "b.npz", most=1) as beside:
            beside.write_text("half")
            raise ArithmeticError

    with pytest.raises(ArithmeticError):
        half()
    assert names(tmp_path) == {"a.npz"}


def test_an_entry_that_is_gone_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        mark_used(tmp_path / "gone.npz")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.95])
def test_a_cut_archive_is_broken_in_a_known_way(tmp_path: Path, share: float) -> None:
    entry = tmp_path / "a.npz"
    np.savez_compressed(entry, x=np.arange(1000))
    content = entry.read_bytes()
    entry.write_bytes(content[: int(share * len(content))])
    with (
        pytest.raises(ForeignFileError),
        foreign_file(entry, "an archive"),
        entry.open("rb") as file,
        np.load(file, allow_pickle=False) as archive,
    ):
        archive["x"].sum()
