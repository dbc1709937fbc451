"""`paravol metrics` on a recording that lies with the tests."""

import csv
import json
from pathlib import Path

import pytest

from app.cli.metrics_command import COLUMNS, OUR_COLUMNS, as_csv, metrics
from app.cli.metrics_command import MetricsOptions as Options
from paravol.scoring.metric_texts import metric_text
from scenarios.metrics import Metric
from system import UserError

SESSION = Path(__file__).parents[2] / "accuracy" / "before_the_move.paravol"

FIGURE = Metric("path length", "scope", "mm", 20.0, sigma=0.5, floor=30.0)
NONE = Metric("SPARC", "scope", "1", None, "not enough data: one movement is needed")


def test_a_session_becomes_a_table_and_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "160")
    table, report = tmp_path / "m.csv", tmp_path / "m.json"
    assert (
        metrics(SESSION, options=Options(csv=table, json_file=report, motion_only=True))
        == 0
    )
    said = capsys.readouterr().out
    assert "scope: path length, raw" in said
    with table.open(newline="") as file:
        rows = list(csv.reader(file))
    assert tuple(rows[0]) == (*COLUMNS, *OUR_COLUMNS)
    told = json.loads(report.read_text())
    assert told["settings"]["cutoff_hz"] == 6.0
    assert len(rows) == 1 + len(told["metrics"])
    for row, metric in zip(rows[1:], told["metrics"], strict=True):
        assert row[:3] == [metric["name"], metric["role"], metric["unit"]]
        value = metric["value"]
        assert row[3] == ("" if value is None else repr(value))
        assert value is not None or row[6]


def test_json_goes_to_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    metrics(SESSION, options=Options(only=("task time",), motion_only=True), json=True)
    told = json.loads(capsys.readouterr().out)
    assert [m["name"] for m in told["metrics"]] == ["task time"] * 2
    assert told["metrics"][0]["value"] > 0


def test_perktutors_columns_come_first() -> None:
    lines = as_csv([FIGURE, NONE]).splitlines()
    assert lines[0].startswith("MetricName,MetricRoles,MetricUnit,MetricValue,")
    assert lines[1] == "path length,scope,mm,20.0,0.5,30.0,below the noise floor"
    assert lines[2] == "SPARC,scope,1,,,,not enough data: one movement is needed"


def test_a_figure_is_told_with_its_error_or_its_reason() -> None:
    assert metric_text(FIGURE) == "20.0 ± 0.5 mm (below the noise floor)"
    assert metric_text(NONE) == NONE.reason


def test_unknown_metrics_and_sessions_are_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="There is no metric named 'speed'"):
        metrics(SESSION, options=Options(only=("speed",), motion_only=True))
    with pytest.raises(UserError, match="is not a session"):
        metrics(tmp_path)
    with pytest.raises(UserError, match="cannot be read"):
        metrics(SESSION, options=Options(settings=tmp_path / "none.toml"))
