"""Flights that nobody asked to record: which are kept, and which are never removed."""

from pathlib import Path

import msgspec
import pytest

from paravol.sessions.session_store import SessionStore, remove_session
from tests.scenarios.session_info import INFO as NAMED

INFO = msgspec.structs.replace(NAMED, automatic=True)


def put(folder: Path, day: int, size: int, *, automatic: bool = True) -> Path:
    folder.mkdir(parents=True)
    info = msgspec.structs.replace(
        INFO, created=f"2026-01-{day:02}T00:00:00+00:00", automatic=automatic
    )
    (folder / "session.json").write_bytes(msgspec.json.encode(info))
    (folder / "stream.mcap").write_bytes(bytes(size))
    return folder


def test_the_oldest_go_first_until_the_rest_is_within_the_limit(tmp_path: Path) -> None:
    # by when they were flown, not by their names
    new = put(tmp_path / "a.paravol", 9, 3000)
    old = put(tmp_path / "b.paravol", 1, 3000)
    middle = put(tmp_path / "c.paravol", 5, 3000)
    kept = SessionStore(tmp_path, limit_bytes=8000)
    assert kept.make_room() == [old]
    assert kept.make_room() == []
    assert new.exists()
    assert middle.exists()
    assert not old.exists()


def test_what_somebody_named_or_put_there_stays(tmp_path: Path) -> None:
    kept = SessionStore(tmp_path / "sessions", limit_bytes=0)
    named = put(kept.folder / "mine.paravol", 1, 3000, automatic=False)
    elsewhere = put(tmp_path / "saved.paravol", 1, 3000)
    (kept.folder / "link.paravol").symlink_to(elsewhere)
    strange = kept.folder / "notes.paravol"
    strange.mkdir()
    (strange / "session.json").write_text("[")
    (kept.folder / "file.paravol").write_text("mine")
    before_it = put(kept.folder / "other name", 1, 3000)
    gone = put(kept.folder / "unasked.paravol", 2, 3000)
    assert kept.make_room() == [gone]
    for path in (named, elsewhere, strange, before_it, kept.folder / "file.paravol"):
        assert path.exists()
    assert (kept.folder / "link.paravol").is_symlink()


def test_a_session_in_which_somebody_put_a_file_stays(tmp_path: Path) -> None:
    kept = SessionStore(tmp_path, limit_bytes=0)
    own = put(tmp_path / "a.paravol", 1, 3000)
    (own / "snapshots").mkdir()
    for name in ("snapshots/view.png", "notes.json", ".DS_Store"):
        (own / name).write_text("x")
    shared = put(tmp_path / "b.paravol", 2, 3000)
    (shared / "thesis.odt").write_text("mine")
    assert kept.make_room() == [own]
    assert not own.exists()
    # by name it goes, and the file stays
    assert kept.sessions() == [shared]
    assert remove_session(shared)
    assert [file.name for file in shared.iterdir()] == ["thesis.odt"]
    assert kept.sessions() == []


def test_a_session_that_goes_meanwhile_ends_no_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two programs make room at once."""
    kept = SessionStore(tmp_path, limit_bytes=0)
    gone, left = (put(tmp_path / f"{n}.paravol", n, 10) for n in (1, 2))
    monkeypatch.setattr(SessionStore, "sessions", lambda _: [gone, left])
    remove_session(gone)
    assert kept.make_room() == [left]


def test_a_session_that_is_being_recorded_is_not_removed(tmp_path: Path) -> None:
    kept = SessionStore(tmp_path, limit_bytes=0)
    with kept.new_session("first flight/../x") as folder:
        assert folder.parent == tmp_path
        (folder / "session.json").write_bytes(msgspec.json.encode(INFO))
        assert kept.make_room() == []
        with kept.new_session("first flight/../x") as second:
            assert second != folder
            assert folder.exists()
    assert kept.make_room() == [folder]


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "sessions").write_text("a file")
    kept = SessionStore(tmp_path / "sessions")
    with pytest.raises(OSError, match="sessions"), kept.new_session("x"):
        pass
