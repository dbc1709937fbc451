"""The README quotes rows, between two marks and nowhere else."""

import msgspec
import pytest

from benchmarks.reporting.quotes import BEGIN, END, filled, quotes
from benchmarks.schema import Results
from tests.benchmarks.reporting.test_pages import tables


def test_what_is_quoted_stands_in_the_rows(results: Results) -> None:
    head, _, cells = tables(quotes(results))
    assert head[-1] == "times faster"
    assert cells[:2] == ["phantom/nasopharynx/wall", "ART, no more error"]
    assert cells[-1] == "7.25"
    assert "1 of 2 rows" in quotes(results)


def test_views_from_outside_are_left_to_the_measurements(results: Results) -> None:
    outside = [
        msgspec.structs.replace(row, case=row.case.replace("nasopharynx", "outside"))
        for row in results.rows
    ]
    assert "ART, no more error" in quotes(results)
    assert "ART, no more error" not in quotes(Results(rows=outside))


def test_only_the_part_between_the_marks_changes(results: Results) -> None:
    text = f"before\n{BEGIN}\nold\n{END}\nafter\n"
    once = filled(text, results)
    assert once.startswith(f"before\n{BEGIN}\n")
    assert once.endswith(f"{END}\nafter\n")
    assert "old" not in once
    assert filled(once, results) == once


@pytest.mark.parametrize(
    "text", ["", BEGIN, END, f"{END}{BEGIN}", f"{BEGIN}{END}{BEGIN}{END}"]
)
def test_marks_that_are_not_there_are_told(text: str, results: Results) -> None:
    with pytest.raises(ValueError, match="line"):
        filled(text, results)
