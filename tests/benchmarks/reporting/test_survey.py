"""Every figure of the report is one of a row."""

import re

import msgspec
import pytest

from benchmarks.losslessness import COMPARED, DIFFER
from benchmarks.reporting.section import duration
from benchmarks.reporting.survey import is_lossless, row_cells, skipping_table, survey
from benchmarks.schema import Results, Row

PARTS = ("machine", "errors", "fronts", "growth", "skipping")


def test_all_parts_are_there_with_and_without_rows(results: Results) -> None:
    full = {section.anchor: section for section in survey(results)}
    empty = {section.anchor: section for section in survey(Results())}
    for part in PARTS:
        assert full[part].tables or full[part].charts, part
        assert not empty[part].tables, part
        assert empty[part].words, part
    assert [t.caption for t in full["missing"].tables] == ["Left out"]
    assert full["missing"].tables[0].rows == [("fsr", "no OpenGL", "2")]


def test_every_row_stands_once_under_its_suite(results: Results) -> None:
    found = [
        cells[0]
        for section in survey(results)
        if section.is_long
        for table in section.tables
        for cells in table.rows
        if not cells[0].startswith("\N{RIGHTWARDS ARROW}")
    ]
    assert sorted(found) == sorted(row.mode for row in results.rows)


def test_further_errors_stand_below_the_row_by_name(results: Results) -> None:
    (row,) = [row for row in results.rows if row.further_rmse]
    own, further = row_cells(row)
    assert own[3] == f"{row.rmse:.2e}"
    assert further[0].endswith("of the unlit picture")
    assert further[3] == "3.25e-03"


def test_a_growth_is_told_with_its_interval(results: Results) -> None:
    growth = next(s for s in survey(results) if s.anchor == "growth")
    (cells,) = growth.tables[0].rows
    told = dict(zip(growth.tables[0].head, cells, strict=True))
    assert (told["from"], told["to"], told["points"]) == ("100", "1,600", "3")
    assert (told["exponent"], told["interval"]) == ("1.00", "1.00 to 1.00")


@pytest.mark.parametrize(
    ("seconds", "told"),
    [(2.5, "2.5 s"), (0.0123, "12.3 ms"), (4.56e-6, "4.56 us"), (7e-9, "7 ns")],
)
def test_a_duration_has_the_unit_that_suits_it(seconds: float, told: str) -> None:
    assert duration(seconds) == told
    assert re.fullmatch(r"[\d.]+ (s|ms|us|ns)", told)


@pytest.mark.parametrize(
    ("counters", "proven"),
    [
        ({COMPARED: 10.0, DIFFER: 0.0}, True),
        ({COMPARED: 10.0, DIFFER: 1.0}, False),
        ({COMPARED: 0.0, DIFFER: 0.0}, False),
        ({COMPARED: 10.0}, False),
        ({}, False),
    ],
)
def test_only_equal_bits_are_a_proof(
    row: Row, counters: dict[str, float], proven: bool
) -> None:
    assert is_lossless(msgspec.structs.replace(row, counters=counters)) == proven


def test_the_ledger_tells_what_was_saved_and_what_failed(results: Results) -> None:
    table = skipping_table(results.rows)
    good, bad = (dict(zip(table.head, row, strict=True)) for row in table.rows)
    assert good["skipped"] == "clear space"
    assert (good["time saved"], good["times faster"]) == ("75%", "4")
    assert good["proof"] == "0 of 5,000 values differ"
    assert bad["proof"] == "7 of 5,000 values differ"
    assert table.bad == {1}
