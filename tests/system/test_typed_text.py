"""What was typed is given once, and nobody waits for it."""

import io
import os

import pytest

from system import typed_text


def test_what_was_typed_is_given_once_and_its_end_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    read, write = os.pipe()
    with open(read, encoding="utf-8") as typed:
        monkeypatch.setattr("sys.stdin", typed)
        assert typed_text() == ""
        os.write(write, b"\nb")
        assert typed_text() == "\nb"
        assert typed_text() == ""
        os.close(write)
        assert typed_text() is None


def test_what_is_no_terminal_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("x"))
    with pytest.raises(OSError, match="fileno"):
        typed_text()
