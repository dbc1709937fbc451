import fcntl
import os
from pathlib import Path

import pytest

from paravol.output_folder import claimed_case, claimed_folder


def test_nothing_is_left_of_a_command_that_fails_at_once(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="wrong"), claimed_folder(tmp_path / "new"):
        raise ValueError("wrong")
    assert not (tmp_path / "new").exists()


def test_what_was_there_and_what_was_written_stays(tmp_path: Path) -> None:
    with claimed_folder(tmp_path):
        pass
    assert not any(tmp_path.iterdir())
    with claimed_folder(tmp_path / "new") as folder:
        (folder / "film").touch()
    assert [file.name for file in folder.iterdir()] == ["film"]


def test_one_command_at_a_time(tmp_path: Path) -> None:
    with claimed_folder(tmp_path):
        # who was refused has not taken the lock away
        for _ in range(2):
            refused = pytest.raises(ValueError, match="Another command")
            with refused, claimed_folder(tmp_path):
                pass


def test_a_lock_that_vanished_while_it_was_taken_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    take = fcntl.flock

    def take_late(handle: int, how: int) -> None:
        (tmp_path / ".lock").unlink()
        take(handle, how)

    monkeypatch.setattr(fcntl, "flock", take_late)
    with pytest.raises(ValueError, match="Another command"), claimed_folder(tmp_path):
        pass


@pytest.mark.parametrize("names", [(), (".lock",), ("case.json", "notes.txt")])
def test_a_case_goes_where_a_case_may_be(
    names: tuple[str, ...], tmp_path: Path
) -> None:
    for name in names:
        (tmp_path / name).touch()
    with claimed_case(tmp_path, force=True) as folder:
        assert folder == tmp_path


def test_a_case_is_written_over_by_force_only(tmp_path: Path) -> None:
    (tmp_path / "case.json").write_text("{}")
    with pytest.raises(ValueError, match=r"holds a case already; .*--force"):
        claimed_case(tmp_path).__enter__()
    (tmp_path / "exercise.toml").write_text("mine")
    with pytest.raises(ValueError, match=r"a case with its exercise\.toml already"):
        claimed_case(tmp_path).__enter__()
    assert sorted(os.listdir(tmp_path)) == ["case.json", "exercise.toml"]


def test_somebody_s_own_volume_is_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "ct.nrrd").write_text("mine")
    with pytest.raises(ValueError, match=r"'ct\.nrrd' and no case"):
        claimed_case(tmp_path).__enter__()
    with pytest.raises(ValueError, match="is a file"):
        claimed_case(tmp_path / "ct.nrrd").__enter__()
    assert os.listdir(tmp_path) == ["ct.nrrd"]


def test_what_a_command_has_added_goes_with_it(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine.txt").touch()
    claim = claimed_folder(tmp_path)
    folder = claim.__enter__()
    (folder / "film").touch()
    (folder / "pictures").mkdir()
    (folder / "pictures" / "one").touch()
    assert not claim.__exit__(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert sorted(os.listdir(tmp_path)) == ["mine", "mine.txt"]


def test_a_case_is_its_owners(tmp_path: Path) -> None:
    with claimed_case(tmp_path / "case") as folder:
        assert folder.stat().st_mode & 0o077 == 0
