"""A mistyped folder is refused; a killed command's spool is removed."""

from pathlib import Path

import pytest

from app.__main__ import main
from app.cli.root import rank_count
from paravol.snapshots.spool_folder import own_spool, require_spool


def test_a_missing_folder_is_refused_and_not_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = tmp_path / "spol"
    assert main(["worker", "--spool", str(missing), "--once"]) == 1
    assert f"no spool folder {missing}" in capsys.readouterr().err
    eye = ["--eye", "0", "0", "0", "--target", "0", "1", "0"]
    words = ["snapshot", "--case", str(tmp_path), *eye, "--spool", str(missing)]
    assert main(words) == 1
    assert f"no spool folder {missing}" in capsys.readouterr().err
    assert not missing.exists()


def test_it_is_made_when_told_to_beside_what_is_there(tmp_path: Path) -> None:
    require_spool(tmp_path / "a", create=True)
    require_spool(tmp_path / "a", create=True)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o700
    with pytest.raises(ValueError, match=r"There is no folder .*/b to make c in"):
        require_spool(tmp_path / "b" / "c", create=True)
    assert not (tmp_path / "b").exists()


def test_a_folder_of_something_else_is_no_spool(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").touch()
    with pytest.raises(ValueError, match=r"it holds 'letter\.txt' and no queue"):
        require_spool(tmp_path)


def test_own_spools_lie_in_the_users_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    left = tmp_path / "paravol" / "spools" / "spool-killed" / "spool"
    left.mkdir(parents=True)
    with own_spool() as folder:
        assert folder.parents[1] == tmp_path / "paravol" / "spools"
        assert not left.exists()


def test_ranks_are_as_many_as_processors_unless_insisted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {0, 1})
    assert rank_count(2, oversubscribe=False) == 2
    assert not capsys.readouterr().err
    assert rank_count(99, oversubscribe=False) == 2
    said = capsys.readouterr().err
    assert said == (
        "99 ranks would share 2 processors and wait for one another; taking 2 "
        "(--oversubscribe takes all 99).\n"
    )
    assert rank_count(99, oversubscribe=True) == 99
    assert not capsys.readouterr().err
