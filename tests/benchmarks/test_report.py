"""The table says what the rows say."""

from pathlib import Path

import msgspec
import pytest

from benchmarks.report import COLUMNS, print_results, results_table, table_cells
from benchmarks.schema import Results, Row, Skipped, Times


def test_cells_match_the_columns(row: Row) -> None:
    cells = dict(zip(COLUMNS, table_cells(row), strict=True))
    assert cells["mode"].strip() == row.mode
    assert cells["ratio"] == "2 cpu"
    assert float(cells["CPU ms"]) == 90.0
    assert float(cells["RMSE"]) == row.rmse
    noisy = msgspec.structs.replace(row, time_s=Times(min=0.1, median=0.5))
    assert table_cells(noisy)[2] == "~500.0"


def test_what_was_not_measured_stays_blank(row: Row) -> None:
    bare = msgspec.structs.replace(
        row, ratio=None, rmse=None, p999=None, error_unit=None
    )
    assert table_cells(bare)[4:] == ("", "", "", "")


def test_a_case_has_one_heading(row: Row) -> None:
    other = msgspec.structs.replace(row, mode="b")
    third = msgspec.structs.replace(row, case="phantom/inside/shaded")
    assert results_table(Results(rows=[row, other, third])).row_count == 5


def test_both_errors_of_a_lit_picture_are_told_by_name(
    row: Row, capsys: pytest.CaptureFixture[str]
) -> None:
    both = {"of the unlit picture": 2e-3, "of the peer's": 3e-3}
    lit = msgspec.structs.replace(row, further_rmse=both)
    print_results(Results(rows=[lit], skipped=[]), [])
    out = capsys.readouterr().out
    first = next(line for line in out.splitlines() if row.mode in line)
    assert "1.00e-03" in first
    for name, error in zip(both, ("2.00e-03", "3.00e-03"), strict=True):
        assert error in next(line for line in out.splitlines() if name in line)


def test_reasons_and_files_are_named(
    row: Row, capsys: pytest.CaptureFixture[str]
) -> None:
    skips = [
        Skipped(suite="fsr", case="c", mode=mode, reason="no OpenGL") for mode in "ab"
    ]
    print_results(Results(rows=[row], skipped=skips), [Path("r.json"), Path("x.png")])
    out = capsys.readouterr().out
    assert "fsr: 2 skipped: no OpenGL" in out
    assert row.mode in out
    assert "1.00e-03" in out
    assert "r.json" in out
    assert "x.png" in out
