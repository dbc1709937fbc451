"""A trainee's record: empty, full, and of a store that cannot be read."""

import sqlite3
from pathlib import Path

from paravol.progress.store import ProgressStore
from paravol.trainee.record import record_of
from scenarios.ladder import ExerciseStatus
from tests.paravol.progress.learners import entry


def test_an_empty_store_is_a_beginning(tmp_path: Path) -> None:
    record = record_of("ann", tmp_path / "p.sqlite")
    assert (record.trainee, record.trainees, record.told) == ("ann", (), "")
    assert all(not exercise.attempts for exercise in record.ladder.exercises)


def test_everybody_has_their_own_results(tmp_path: Path) -> None:
    file = tmp_path / "p.sqlite"
    for trainee in ("ann", ""):
        for number in (1, 2, 3):
            ProgressStore(file).add(entry(trainee, number, has_passed=trainee == "ann"))
    own, nobody = record_of("ann", file), record_of("", file)
    assert own.trainees == nobody.trainees == ("ann",)
    doors = [r.ladder.find("hoops").door for r in (own, nobody)]  # type: ignore[union-attr]
    assert doors == [ExerciseStatus.PASSED, ExerciseStatus.OPEN]


def test_a_damaged_store_is_set_aside_and_told(tmp_path: Path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    file = tmp_path / "paravol" / "progress.sqlite"
    file.parent.mkdir()
    file.write_bytes(b"SQLite format 3\x00" + bytes(range(256)) * 16)
    record = record_of("")
    assert "damaged" in record.told
    assert record.ladder.exercises
    assert record_of("").told == ""


def test_a_store_of_a_newer_program_is_told_and_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "p.sqlite"
    ProgressStore(file)
    with sqlite3.connect(file) as store:
        store.execute("PRAGMA user_version = 999")
    store.close()
    before = file.read_bytes()
    record = record_of("ann", file)
    assert "newer version" in record.told
    assert record.ladder.exercises
    assert file.read_bytes() == before


def test_a_folder_that_cannot_be_made_is_told_in_words(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    record = record_of("ann", tmp_path / "file" / "p.sqlite")
    assert record.told.startswith("Your results cannot be read: ")
    assert "Errno" not in record.told
    assert str(tmp_path / "file") in record.told
    assert record.ladder.exercises
