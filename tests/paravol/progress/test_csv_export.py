"""Sessions as a table for a spreadsheet."""

import csv
from io import StringIO

from paravol.progress.csv_export import COLUMNS, as_csv
from tests.paravol.progress.learners import ENTRIES, entry


def test_a_table_has_a_row_for_each_figure() -> None:
    rows = list(csv.DictReader(StringIO(as_csv(ENTRIES))))
    assert set(rows[0]) == set(COLUMNS)
    assert len(rows) == 3 * 3 + 1
    first = rows[0]
    assert (first["trainee"], first["figure"], first["value"]) == (
        *("ann", "path length", "200.0"),
    )
    assert (first["sigma"], first["passed"], first["rubric"]) == ("0.25", "", "")
    percent = rows[3]
    assert (percent["figure"], percent["value"]) == ("percent", "81.5")
    assert (percent["passed"], percent["rubric_version"]) == ("true", "2")
    # no tool was held: an empty cell, not a zero
    assert rows[2]["value"] == ""
    assert as_csv([]).count("\n") == 1


def test_no_cell_is_a_formula() -> None:
    table = as_csv([entry(exercise="=cmd|' /C calc'!A0")])
    for row in csv.reader(StringIO(table)):
        assert not any(cell.startswith(("=", "+", "@")) for cell in row)
