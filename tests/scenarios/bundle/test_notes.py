"""Notes lie beside a recording, which they leave as it is."""

import threading
from pathlib import Path

import pytest

from paravol.progress.session_entry import bundle_sha256
from scenarios.bundle import Note, add_note, read_notes, remove_note
from system import UserError


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    folder = tmp_path / "a.paravol"
    folder.mkdir()
    (folder / "session.json").write_text("{}")
    (folder / "stream.mcap").write_bytes(b"a stream")
    return folder


def test_notes_come_back_in_order_of_time(bundle: Path) -> None:
    before = bundle_sha256(bundle)
    assert read_notes(bundle) == ()
    add_note(bundle, 12.5, "  Too near to the orbit.  ")
    add_note(bundle, 3.0, 'Good: "ruhig" \U0001f642\nsecond line')
    notes = read_notes(bundle)
    assert notes == (
        Note(3.0, 'Good: "ruhig" \U0001f642\nsecond line'),
        Note(12.5, "Too near to the orbit."),
    )
    assert bundle_sha256(bundle) == before
    assert remove_note(bundle, 1) == notes[1:]
    assert read_notes(bundle) == notes[1:]
    names = sorted(p.name for p in bundle.iterdir())
    assert names == ["notes.json", "session.json", "stream.mcap"]


def test_teachers_at_once_lose_no_note(bundle: Path) -> None:
    def write(number: int) -> None:
        for at in range(5):
            add_note(bundle, float(at), f"{number} {at}")

    threads = [threading.Thread(target=write, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(read_notes(bundle)) == 20


def test_what_is_no_note_is_refused(bundle: Path, tmp_path: Path) -> None:
    for at_s, text in ((1.0, " "), (1.0, "x" * 2001), (-1.0, "x"), (float("nan"), "x")):
        with pytest.raises(UserError, match="note"):
            add_note(bundle, at_s, text)
    assert read_notes(bundle) == ()
    with pytest.raises(UserError, match="no number 1"):
        remove_note(bundle, 1)
    with pytest.raises(UserError, match="is not a session"):
        add_note(tmp_path, 1.0, "x")
    (bundle / "notes.json").write_text('{"notes": [\n{"at_s": -4, "text": "x"}]}')
    with pytest.raises(UserError, match=r"notes\.json, line 2"):
        read_notes(bundle)
    # a file that cannot be read is not overwritten
    with pytest.raises(UserError):
        add_note(bundle, 1.0, "x")
    assert "-4" in (bundle / "notes.json").read_text()
