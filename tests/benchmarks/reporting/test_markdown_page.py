"""The page says what the rows say, once each."""

from pathlib import Path

import msgspec

from benchmarks.measurements import measurements_page, write_measurements
from benchmarks.schema import Results, Row, Skipped, Times


def tables(page: str) -> list[list[str]]:
    """Give the cells of every line of every table."""
    lines = [line for line in page.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


def test_every_row_is_told_once_under_its_suite_and_case(row: Row) -> None:
    other = msgspec.structs.replace(row, mode="other", ratio=None, rmse=None, p999=None)
    late = msgspec.structs.replace(row, suite="zz", case="late case")
    page = measurements_page(Results(rows=[row, late, other]))
    assert page.count(f"**{row.case}**") == 1
    assert page.index(f"## {row.suite}") < page.index("## zz") < page.index("late case")
    modes = [cells[0] for cells in tables(page)]
    assert modes.count(row.mode) == 2
    assert modes.count("other") == 1


def test_figures_are_those_of_the_row(row: Row) -> None:
    timed = msgspec.structs.replace(row, time_s=Times(min=0.0123, median=0.0124))
    assert row.rmse is not None
    head, _, cells = tables(measurements_page(Results(rows=[timed])))
    told = dict(zip(head, cells, strict=True))
    assert told["time"] == "12.3 ms"
    assert float(told["ratio"]) == row.ratio
    assert float(told["RMSE"]) == row.rmse
    assert told["unit"] == row.error_unit


def test_a_disturbed_row_is_marked(row: Row) -> None:
    noisy = msgspec.structs.replace(row, time_s=Times(min=1.5, median=2.5))
    assert "| ~1.5 s |" in measurements_page(Results(rows=[noisy]))


def test_what_was_left_out_is_told_once_with_its_reason(row: Row) -> None:
    skips = [Skipped(suite="fsr", case="c", mode=m, reason="no OpenGL") for m in "ab"]
    page = measurements_page(Results(rows=[row], skipped=skips))
    assert page.count("- fsr: no OpenGL") == 1


def test_the_page_is_written_beside_the_results(row: Row, tmp_path: Path) -> None:
    results = Results(rows=[row])
    path = write_measurements(results, tmp_path)
    assert path.parent == tmp_path
    assert path.read_text(encoding="utf-8") == measurements_page(results)
