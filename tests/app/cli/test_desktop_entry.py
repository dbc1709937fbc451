"""The entry starts the program, wherever it lies, and goes without a trace."""

import configparser
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.__main__ import main
from app.cli.desktop_entry import ICON, command, entry_text, quoted
from system import UserError

WORDS = st.text(st.characters(codec="utf-8", exclude_characters="\n\r\0"), min_size=1)


def read(text: str) -> dict[str, str]:
    parser = configparser.RawConfigParser(
        delimiters=("=",), comment_prefixes=("#",), interpolation=None
    )
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read_string(text)
    assert parser.sections() == ["Desktop Entry"]
    return dict(parser["Desktop Entry"])


def started(value: str) -> list[str]:
    """Undo the specification's two escapings: of strings, then of arguments."""
    plain = value.replace("\\\\", "\0").replace("\0", "\\")
    words, at = [], 0
    while at < len(plain):
        if plain[at] == " ":
            at += 1
            continue
        word = ""
        if plain[at] == '"':
            at += 1
            while plain[at] != '"':
                at += plain[at] == "\\"
                word += plain[at]
                at += 1
            at += 1
        else:
            while at < len(plain) and plain[at] != " ":
                word += plain[at]
                at += 1
        words.append(word.replace("%%", "%"))
    return words


@given(st.lists(WORDS, min_size=1, max_size=4))
def test_whatever_the_words_are_they_come_back(words: list[str]) -> None:
    assert started(" ".join(quoted(word) for word in words)) == words


def test_what_needs_no_quotes_has_none() -> None:
    assert quoted("/opt/paravol/bin/paravol") == "/opt/paravol/bin/paravol"
    assert quoted("/home/a b/paravol") == '"/home/a b/paravol"'
    assert quoted("100%") == "100%%"
    with pytest.raises(UserError, match="line break"):
        quoted("a\nb")


def test_the_entry_starts_this_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert main(["desktop-entry"]) == 0
    entry = tmp_path / "applications" / "paravol.desktop"
    assert str(entry) in capsys.readouterr().out
    told = read(entry.read_text("utf-8"))
    words = started(told["Exec"])
    assert words == command()
    assert words[-1] == "train"
    # what it starts is there and answers
    done = subprocess.run(
        [*words[:-1], "--help"], capture_output=True, text=True, timeout=60, cwd="/"
    )
    assert done.returncode == 0
    assert "Start with: paravol demo" in done.stdout
    icon = Path(told["Icon"])
    assert icon.read_bytes() == ICON.read_bytes()
    assert told["Type"] == "Application"
    assert told["Terminal"] == "false"
    assert told["Categories"].endswith(";")
    assert main(["desktop-entry", "--remove"]) == 0
    assert not entry.exists()
    assert not icon.exists()
    assert main(["desktop-entry", "--remove"]) == 0


@pytest.mark.skipif(
    shutil.which("desktop-file-validate") is None, reason="no desktop-file-validate"
)
def test_the_desktops_own_tool_reads_it(tmp_path: Path) -> None:
    file = tmp_path / "paravol.desktop"
    file.write_text(entry_text(["/opt/a b/paravol", "train"], ICON), "utf-8")
    done = subprocess.run(
        ["desktop-file-validate", str(file)], capture_output=True, text=True
    )
    assert (done.returncode, done.stdout) == (0, "")


def test_what_the_desktop_refuses_is_not_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tool = tmp_path / "desktop-file-validate"
    tool.write_text("#!/bin/sh\necho 'no such key'\nexit 1\n")
    tool.chmod(0o755)
    monkeypatch.setattr("shutil.which", lambda name: str(tool))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert main(["desktop-entry"]) == 1
    assert "no such key" in capsys.readouterr().err
    assert list((tmp_path / "data" / "applications").iterdir()) == []


def test_elsewhere_one_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.platform", "darwin")
    assert main(["desktop-entry"]) == 1
    assert "Linux desktops" in capsys.readouterr().err


def test_the_icon_is_a_picture_of_its_own() -> None:
    """It asks for nothing from elsewhere, and scales."""
    tree = ET.parse(ICON).getroot()
    assert tree.tag == "{http://www.w3.org/2000/svg}svg"
    assert tree.get("viewBox") == "0 0 128 128"
    text = ICON.read_text("utf-8")
    assert "href" not in text
    assert "<script" not in text
