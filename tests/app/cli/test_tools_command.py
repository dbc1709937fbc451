"""`paravol tools`: every tool of the catalogue is listed, once."""

import json

import pytest

from app.cli.tools_command import tools
from scenarios.instruments import INSTRUMENTS


def test_every_tool_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert tools() == 0
    told = capsys.readouterr().out
    assert all(told.count(f"{name} ") == 1 for name in INSTRUMENTS)
    assert "bite; shaft 3.2, jaw 10" in told


def test_a_program_is_told_all_sizes(capsys: pytest.CaptureFixture[str]) -> None:
    assert tools(json=True) == 0
    told = json.loads(capsys.readouterr().out)
    assert list(told) == list(INSTRUMENTS)
    assert told["microdebrider"]["needs_suction"] is True
    assert told["microdebrider"]["shape"]["outer_mm"] == 4.0
    assert told["ball probe"]["shape"]["ball_mm"] == 2.0
