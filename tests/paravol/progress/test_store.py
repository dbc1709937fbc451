"""The store keeps what it was given, whole, and deletes it for good."""

import os
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from paravol.progress import tables
from paravol.progress.store import ProgressStore, users_store
from system import UserError
from tests.paravol.progress.learners import entry


def family(file: Path) -> list[Path]:
    """Give a store's file, and the log and index beside it."""
    return [p for p in file.parent.iterdir() if p.name.startswith(file.name)]


def test_what_goes_in_comes_out(tmp_path: Path) -> None:
    entries = [
        entry(number=1),
        entry(number=2, percent=81.5, has_passed=True),
        entry("", 3, path_mm=None, has_passed=False),
    ]
    for each in reversed(entries):
        assert ProgressStore(tmp_path / "p.sqlite").add(each)
    store = ProgressStore(tmp_path / "p.sqlite")
    assert store.sessions() == entries
    assert store.sessions(trainee="ann") == entries[:2]
    assert store.sessions(trainee="") == entries[2:]
    assert store.sessions(exercise="none") == []
    assert store.trainees() == ["", "ann"]
    assert not store.told
    assert (tmp_path / "p.sqlite").stat().st_mode & 0o077 == 0


def test_a_session_is_kept_once_and_has_one_owner(tmp_path: Path) -> None:
    store = ProgressStore(tmp_path / "p.sqlite")
    first = entry(percent=50.0)
    assert store.add(first)
    again = entry(percent=90.0, has_passed=True)
    assert not store.add(again)
    assert store.sessions() == [again]
    theirs = type(first)(
        **{f: getattr(again, f) for f in again.__struct_fields__} | {"trainee": "bob"}
    )
    assert not store.add(theirs)
    assert store.trainees() == ["bob"]


def test_names_that_may_tell_who_somebody_is_are_refused(tmp_path: Path) -> None:
    store = ProgressStore(tmp_path / "p.sqlite")
    for name in ("ann@example.org", "x" * 41, "a/b", "a\nb", "=1+1"):
        with pytest.raises(UserError, match="make up one"):
            store.add(entry(name))
    store.add(entry("Blauer Enzian_2"))


def test_deleted_bytes_are_gone_from_the_file_and_its_log(tmp_path: Path) -> None:
    """Other sessions stay, and so does what they need."""
    file = tmp_path / "p.sqlite"
    store = ProgressStore(file)
    gone = [entry("Zanthoxylum", n, exercise="quixotic") for n in range(1, 13)]
    kept = [entry("ann", n) for n in range(1, 13)]
    # a reader keeps the log from being emptied by itself
    reader = sqlite3.connect(file)
    for pair in zip(gone, kept, strict=True):
        for each in pair:
            store.add(each)
    assert reader.execute("SELECT count(*) FROM sessions").fetchone() == (24,)
    told = b"".join(part.read_bytes() for part in family(file))
    marks = [b"Zanthoxylum", b"quixotic", gone[3].sha256.encode()]
    assert all(mark in told for mark in marks)
    assert store.delete([each.sha256 for each in gone]) == 12
    left = b"".join(part.read_bytes() for part in family(file))
    assert not any(mark in left for mark in marks)
    assert kept[3].sha256.encode() in left
    reader.close()
    assert store.sessions() == kept
    assert store.trainees() == ["ann"]


def test_a_log_that_somebody_reads_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("paravol.progress.store.BUSY_S", 0.1)
    file = tmp_path / "p.sqlite"
    store = ProgressStore(file)
    store.add(entry())
    reader = sqlite3.connect(file, isolation_level=None)
    reader.execute("BEGIN")
    reader.execute("SELECT count(*) FROM sessions").fetchone()
    with pytest.raises(UserError, match="another program"):
        store.delete([entry().sha256])
    reader.execute("COMMIT")
    reader.close()
    assert store.delete([entry().sha256]) == 0
    assert entry().sha256.encode() not in b"".join(p.read_bytes() for p in family(file))


ADDER = """
import sys
from pathlib import Path
from paravol.progress.store import ProgressStore
from tests.paravol.progress.learners import entry
for n in range(1, 13):
    ProgressStore(Path(sys.argv[1])).add(entry(sys.argv[2], n))
"""


@pytest.mark.slow
def test_two_programs_at_once_lose_nothing(tmp_path: Path) -> None:
    file = tmp_path / "p.sqlite"
    programs = [
        subprocess.Popen([sys.executable, "-c", ADDER, str(file), name])
        for name in ("ann", "bob")
    ]
    assert [program.wait(60) for program in programs] == [0, 0]
    store = ProgressStore(file)
    for name in ("ann", "bob"):
        assert store.sessions(trainee=name) == [entry(name, n) for n in range(1, 13)]


KILLED = """
import os, signal, sys
from pathlib import Path
from paravol.progress import store
from paravol.progress.store import ProgressStore
from tests.paravol.progress.learners import entry
kept = ProgressStore(Path(sys.argv[1]))
kept.add(entry("ann", 1))
insert = store._insert_details
def die(*everything):
    insert(*everything)
    os.kill(os.getpid(), signal.SIGKILL)
store._insert_details = die
kept.add(entry("bob", 2))
"""


@pytest.mark.slow
def test_a_program_killed_while_it_writes_leaves_the_store_whole(
    tmp_path: Path,
) -> None:
    file = tmp_path / "p.sqlite"
    killed = subprocess.run([sys.executable, "-c", KILLED, str(file)], check=False)
    assert killed.returncode == -signal.SIGKILL
    store = ProgressStore(file)
    assert store.sessions() == [entry("ann", 1)]
    assert store.trainees() == ["ann"]
    assert not store.told


@pytest.mark.parametrize("damage", ["torn", "pages", "header"])
def test_a_damaged_store_is_set_aside_and_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: str
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    store = ProgressStore()
    assert store.file == users_store() == tmp_path / "paravol" / "progress.sqlite"
    for n in range(1, 25):
        store.add(entry("ann", n))
    whole = store.file.read_bytes()
    broken = {
        "torn": whole[: len(whole) // 2],
        "pages": whole[:4096] + os.urandom(len(whole) - 4096),
        "header": b"no store" + whole[8:],
    }[damage]
    store.file.write_bytes(broken)
    new = ProgressStore()
    assert "damaged" in new.told
    assert new.sessions() == []
    (aside,) = store.file.parent.glob("*.damaged-*")
    assert aside.name in new.told
    assert aside.read_bytes() == broken
    assert new.add(entry())
    assert not ProgressStore().told


def test_a_file_that_is_no_store_is_left_alone(tmp_path: Path) -> None:
    text = tmp_path / "thesis.txt"
    text.write_text("three years of work")
    with pytest.raises(UserError, match="is no progress store"):
        ProgressStore(text)
    assert text.read_text() == "three years of work"
    theirs = tmp_path / "theirs.sqlite"
    with sqlite3.connect(theirs) as connection:
        connection.execute("CREATE TABLE sessions (id)")
    connection.close()
    with pytest.raises(UserError, match="another program's"):
        ProgressStore(theirs)
    assert [p.name for p in tmp_path.glob("*damaged*")] == []


def test_a_store_that_cannot_be_opened_now_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "folder.sqlite").mkdir()
    with pytest.raises(UserError, match="cannot be used now: unable to open"):
        ProgressStore(tmp_path / "folder.sqlite")

    def full(connection: object, record: object) -> None:
        raise sqlite3.OperationalError("database or disk is full")

    monkeypatch.setattr("paravol.progress.store._set_up", full)
    with pytest.raises(UserError, match="disk is full"):
        ProgressStore(tmp_path / "p.sqlite")


def test_an_older_store_is_brought_up_to_date(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By steps, each once, rows kept; a newer one is refused."""
    file = tmp_path / "p.sqlite"
    ProgressStore(file).add(entry())
    add = "ALTER TABLE sessions ADD COLUMN place TEXT NOT NULL DEFAULT 'here'"
    rename = "UPDATE sessions SET place = 'there'"
    monkeypatch.setattr(tables, "STEPS", [(add,), (rename,)])
    for _ in range(2):
        assert ProgressStore(file).sessions() == [entry()]
    connection = sqlite3.connect(file)
    assert connection.execute("SELECT place FROM sessions").fetchall() == [("there",)]
    assert connection.execute("PRAGMA user_version").fetchone() == (3,)
    connection.close()
    monkeypatch.setattr(tables, "STEPS", [])
    with pytest.raises(UserError, match="newer version"):
        ProgressStore(file)


def test_a_step_that_fails_leaves_the_older_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "p.sqlite"
    ProgressStore(file).add(entry())
    good = "ALTER TABLE sessions ADD COLUMN place TEXT"
    monkeypatch.setattr(tables, "STEPS", [(good, "UPDATE nowhere SET place = 1")])
    with pytest.raises(Exception, match="no such table"):
        ProgressStore(file)
    monkeypatch.setattr(tables, "STEPS", [])
    assert ProgressStore(file).sessions() == [entry()]
