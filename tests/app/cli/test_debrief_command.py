"""`paravol debrief` on a recording that lies with the tests."""

import json
from pathlib import Path

import pytest

from app.__main__ import main
from app.cli.debrief_command import beside

SESSION = Path(__file__).parents[2] / "accuracy" / "before_the_move.paravol"


def test_a_debrief_lies_beside_its_session() -> None:
    assert beside(Path("a/b.paravol")) == Path("a/b-debrief.html")
    assert beside(Path("a/b")) == Path("a/b-debrief.html")


def test_what_is_no_session_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a.html"
    assert main(["debrief", str(tmp_path), "--out", str(out)]) != 0
    assert "session.json" in capsys.readouterr().err
    assert not out.exists()


def test_an_unknown_rubric_is_refused_before_anything_is_stepped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a.html"
    words = ["debrief", str(SESSION), "--out", str(out), "--rubric", "endoscpy"]
    assert main(words) != 0
    assert "did you mean 'endoscopy'?" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.slow
def test_a_flight_becomes_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a.html"
    words = ["debrief", str(SESSION), "--out", str(out), "--no-pictures", "--json"]
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["out"] == str(out)
    assert told["size_bytes"] == out.stat().st_size
    assert told["rubric"] == "endoscopy"
    assert told["pictures"] == 0
