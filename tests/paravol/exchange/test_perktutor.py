"""PerkTutor's XML: round trips, its own words, and files that mean harm."""

import re
from pathlib import Path

import numpy as np
import pytest

from paravol.exchange import perktutor
from paravol.exchange.perktutor import read_perktutor, write_perktutor
from paravol.exchange.tool_motion import Message, Motions, ToolMotion
from system import ForeignFileError
from tests.paravol.exchange.made_motion import motions

THEIRS = """<TransformRecorderLog>
  <log TimeStampSec="12" TimeStampNSec="5" type="message" message="begin" />
  <log TimeStampSec="14" TimeStampNSec="500000000" type="transform" \
DeviceName="StylusTipToReference" transform="1 0 0 -20 0 0 -1 30 0 1 0 40 0 0 0 1" />
  <log TimeStampSec="13" TimeStampNSec="250000000" type="transform" \
DeviceName="StylusTipToReference" transform="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 " />
  <other what="ever" />
</TransformRecorderLog>
"""


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    """To the bit and the nanosecond; what is invalid has no place in the format."""
    written = motions()
    write_perktutor(tmp_path / "a.xml", written)
    found = read_perktutor(tmp_path / "a.xml")
    assert found.messages == written.messages
    for tool, before in zip(found.tools, written.tools, strict=True):
        assert tool.name == before.name
        assert np.abs(tool.time_s - before.time_s[before.valid]).max() < 1e-9
        assert np.array_equal(
            tool.world_from_tool, before.world_from_tool[before.valid]
        )
        assert tool.valid.all()


def test_a_file_of_their_own_words(tmp_path: Path) -> None:
    """In any order; RAS becomes LPS."""
    (tmp_path / "a.xml").write_text(THEIRS)
    found = read_perktutor(tmp_path / "a.xml")
    (tool,) = found.tools
    assert tool.name == "StylusTipToReference"
    assert tool.time_s.tolist() == [13.25, 14.5]
    assert tool.world_from_tool[1, :3, 3].tolist() == [20.0, -30.0, 40.0]
    assert tool.world_from_tool[1, :3, 2].tolist() == [0.0, 1.0, 0.0]
    assert found.messages == (Message(12.000000005, "begin"),)


@pytest.mark.parametrize("time_s", [-0.25, 0.0, 1.9999999999, 1.7e9 + 0.123456])
def test_times_keep_their_nanoseconds(tmp_path: Path, time_s: float) -> None:
    one = ToolMotion("a", np.array([time_s]), np.eye(4)[None], np.ones(1, np.bool_))
    write_perktutor(tmp_path / "a.xml", Motions((one,)))
    text = (tmp_path / "a.xml").read_text()
    found = re.search(r'TimeStampNSec="(\d+)"', text)
    assert found is not None
    assert 0 <= int(found[1]) < 1_000_000_000
    assert read_perktutor(tmp_path / "a.xml").tools[0].time_s[0] == pytest.approx(
        time_s, abs=5e-10, rel=1e-15
    )


BOMB = (
    '<!DOCTYPE TransformRecorderLog [<!ENTITY a "aaaaaaaaaa">'
    + "".join(
        f'<!ENTITY {n} "{10 * f"&{m};"}">'
        for m, n in zip("abcdefgh", "bcdefghi", strict=True)
    )
    + ']><TransformRecorderLog><log message="&i;"/></TransformRecorderLog>'
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BOMB, "document type"),
        (
            '<!DOCTYPE a SYSTEM "file:///etc/passwd"><TransformRecorderLog/>',
            "document type",
        ),
        ("<html></html>", "begins with html"),
        (THEIRS[:200], "damaged, cut off"),
        (THEIRS.replace("1 0 0 -20", "1 0 -20"), "15 numbers"),
        (THEIRS.replace("1 0 0 -20", "1 0 x -20"), "x"),
        (THEIRS.replace('DeviceName="StylusTipToReference"', ""), "no 'DeviceName'"),
        ("", "damaged, cut off"),
    ],
)
def test_harm_is_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "a.xml").write_text(text)
    with pytest.raises(ForeignFileError, match=words) as caught:
        read_perktutor(tmp_path / "a.xml")
    assert "a.xml" in str(caught.value)
    assert "passwd" not in str(caught.value)


def test_sizes_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.xml").write_text(THEIRS)
    monkeypatch.setattr(perktutor, "MOST_FRAMES", 2)
    with pytest.raises(ForeignFileError, match="more than 2 entries"):
        read_perktutor(tmp_path / "a.xml")
    monkeypatch.setattr(perktutor, "LARGEST_FILE", 100)
    with pytest.raises(ForeignFileError, match="too large"):
        read_perktutor(tmp_path / "a.xml")
