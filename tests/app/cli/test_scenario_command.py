"""`paravol scenario`: list, check, show."""

import json
from pathlib import Path

import pytest

from app.cli.scenario_command import check, list_exercises, show
from scenarios.scenario import bundled_scenarios
from system import UserError

OWN = """
name = "own"
title = "One's own"

[head]
scene = "hoops"
seed = 2

[[tasks]]
kind = "reach"
name = "first"
title = "Bring the tip to the first hoop"
place = "hoop 1"
radius_mm = 3.0
"""


def test_all_exercises_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert list_exercises(json=True) == 0
    told = json.loads(capsys.readouterr().out)
    assert {each["name"] for each in told} == set(bundled_scenarios())
    doors = {each["name"]: each["door"] for each in told}
    assert doors["hoops"] == "open"
    assert doors["sphenoidotomy"] == "locked"


def test_results_open_exercises(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "results.json"
    file.write_text('{"centring": [true, true, true]}')
    assert list_exercises(results=file, json=True) == 0
    told = {each["name"]: each for each in json.loads(capsys.readouterr().out)}
    assert told["centring"]["door"] == "passed"
    assert told["steady-hold"]["door"] == "open"
    assert list_exercises(results=file) == 0
    assert "three in a row" in capsys.readouterr().out
    file.write_text('{"centring": "often"}')
    with pytest.raises(UserError, match=r"results\.json, line 1"):
        list_exercises(results=file)


def test_a_file_is_checked_against_its_head(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "own.toml"
    file.write_text(OWN)
    assert check(file) == 0
    assert "1 tasks, all in order" in capsys.readouterr().out
    file.write_text(OWN.replace("hoop 1", "hop 1"))
    assert check(file) == 1
    said = capsys.readouterr().out
    assert "line 13" in said
    assert "did you mean 'hoop 1'?" in said
    with pytest.raises(UserError, match=r"ends in \.toml"):
        check(tmp_path)


def test_an_exercise_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert show("sphenoidotomy") == 0
    said = capsys.readouterr().out
    assert "onodi:right" in said
    with pytest.raises(UserError, match="did you mean 'sphenoidotomy'"):
        show("sphenoidotomi")
