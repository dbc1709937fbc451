"""Names and titles from files reach terminals as text that can be seen."""

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.__main__ import main
from app.cli.terminal import ProgressReporter, print_table
from system.plain_text import PlainStream, plain

EVIL = "\x1b]52;c;cm0gLXJm\x07 [/bold] [advanced] \x1b[2J\x9b31m\u202eexe.\ud800"
"""Writes the clipboard, ends a style, clears the screen, turns the order."""


@given(st.text())
def test_plain_text_holds_no_command(text: str) -> None:
    told = plain(text)
    assert all(c.isprintable() or c in "\n\t" or ord(c) > 0x7F for c in told)
    assert not any(ord(c) < 32 and c not in "\n\t" for c in told)
    assert not any(0x7F <= ord(c) < 0xA0 or 0x202A <= ord(c) <= 0x202E for c in told)
    told.encode()
    assert plain(told) == told
    assert len(told) == len(text)


@given(st.text(st.characters(categories=("L", "N", "P", "S", "Zs"))))
def test_what_can_be_seen_stays(text: str) -> None:
    assert plain(text) == text


@pytest.mark.parametrize("encoding", ["cp437", "ascii", "latin-1", "utf-8"])
def test_what_a_terminal_cannot_write_is_replaced(encoding: str) -> None:
    raw = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    stream = PlainStream(raw)
    assert stream.write("✓ Kieferhöhle │ 鼻 \x1b[2J") > 0
    raw.flush()
    written = raw.buffer.getvalue()
    assert b"\x1b" not in written
    assert ("✓".encode() in written) == (encoding == "utf-8")


def test_tables_and_stages_show_names_as_they_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    print_table(f"Title {EVIL}", [(f"name {EVIL}", f"value {EVIL}")])
    with ProgressReporter() as stages:
        stages.say(f"say {plain(EVIL)}")
    told = capsys.readouterr()
    for text in (told.out, told.err):
        assert not {"\x1b", "\x07", "\x9b", "\u202e"} & {*text}
        assert "[/bold]" in text
        assert "[advanced]" in text


@pytest.mark.parametrize(
    "words",
    [["score"], ["replay"], ["debrief"], ["metrics"], ["scenario", "check"],
     ["train", "--scenario"], ["export"], ["import"]],
)  # fmt: skip
def test_every_command_tells_a_name_as_text(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file that is not there, is empty, or says what it likes, is told by name."""
    place = tmp_path / EVIL.replace("/", "").replace("\ud800", "")
    place.mkdir()
    (place / "session.json").write_text('{"scenario": "\x1b[2J"}')
    assert main([*words, str(place)]) != 0
    told = capsys.readouterr()
    assert not {"\x1b", "\x07", "\x9b", "\u202e"} & {*told.out, *told.err}
    assert told.err


def test_a_terminal_of_few_letters_is_no_traceback() -> None:
    """As Windows' console is, and a pipe without a locale."""
    program = "import sys; from app.__main__ import main; sys.exit(main(['doctor']))"
    for encoding in ("cp437", "ascii"):
        done = subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONIOENCODING": encoding},
            capture_output=True,
            timeout=120,
            check=False,
        )
        assert b"Traceback" not in done.stderr
        assert done.stdout
