import errno
import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from app.errors import sentence
from system import whole_file


def test_a_file_takes_its_place_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / "a.txt"
    with whole_file(path) as beside:
        assert beside.parent == path.parent
        assert beside.suffix == ".txt"
        beside.write_text("one", "utf-8")
        assert not path.exists()
    assert path.read_text("utf-8") == "one"
    assert stat.S_IMODE(path.stat().st_mode) == 0o644
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_half_a_file_leaves_the_old_one(
    tmp_path: Path, error: type[BaseException]
) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old", "utf-8")

    def write() -> None:
        with whole_file(path) as beside:
            beside.write_text("ne", "utf-8")
            raise error

    with pytest.raises(error):
        write()
    assert path.read_text("utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_is_gone_may_stay_gone_and_a_file_be_its_owners(
    tmp_path: Path,
) -> None:
    with (
        pytest.raises(FileNotFoundError),
        whole_file(tmp_path / "gone" / "a.json", makes_folder=False),
    ):
        pass
    assert not list(tmp_path.iterdir())
    path = tmp_path / "a.json"
    with whole_file(path, prefix=".half-", ending="", mode=0o600) as beside:
        assert beside.name.startswith(".half-")
        assert beside.suffix == ""
        beside.write_text("{}", "utf-8")
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_writer_may_have_replaced_the_other_file_itself(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    with whole_file(path) as beside:
        third = tmp_path / "third"
        third.write_text("three", "utf-8")
        third.replace(beside)
    assert path.read_text("utf-8") == "three"


def test_what_cannot_be_replaced_is_told(tmp_path: Path) -> None:
    (tmp_path / "folder.txt" / "full").mkdir(parents=True)
    with (
        pytest.raises(OSError, match=r"folder\.txt"),
        whole_file(tmp_path / "folder.txt") as beside,
    ):
        beside.write_text("x", "utf-8")
    assert [p.name for p in tmp_path.iterdir()] == ["folder.txt"]


def test_a_refusal_names_what_was_asked_for() -> None:
    path = Path("/proc/picture.png")
    with pytest.raises(OSError, match="No such file") as caught, whole_file(path):
        pass
    assert caught.value.filename == str(path)


@pytest.mark.parametrize(
    ("umask", "mode"), [(0o077, 0o600), (0o022, 0o644), (2, 0o664)]
)
def test_a_file_is_as_open_as_its_user_wants(
    tmp_path: Path, umask: int, mode: int
) -> None:
    program = (
        "import sys, pathlib; from system import whole_file\n"
        "with whole_file(pathlib.Path(sys.argv[1])) as beside: beside.touch()"
    )
    file = tmp_path / "a"
    subprocess.run([sys.executable, "-c", program, file], check=True, umask=umask)
    assert stat.S_IMODE(file.stat().st_mode) == mode


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS])
def test_a_full_disk_is_told_with_the_file_that_was_asked_for(
    tmp_path: Path, number: int
) -> None:
    file = tmp_path / "a.csv"
    with pytest.raises(OSError, match=re.escape(str(file))), whole_file(file):
        raise OSError(number, os.strerror(number))
    told = sentence(OSError(number, os.strerror(number), str(file)))
    assert told is not None
    assert str(file) in told
    # an error about another file keeps its name
    with pytest.raises(OSError, match="elsewhere"), whole_file(file):
        raise OSError(number, os.strerror(number), "elsewhere")
    assert not list(tmp_path.iterdir())
