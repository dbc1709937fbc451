"""The page of Markdown says what the sections say."""

import msgspec

from benchmarks.reporting.markdown_page import markdown_table, measurements_page
from benchmarks.reporting.section import Table
from benchmarks.reporting.survey import survey
from benchmarks.schema import Results, Times


def tables(page: str) -> list[list[str]]:
    """Give the cells of every line of every table."""
    lines = [line for line in page.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


def test_every_section_and_every_row_is_told(results: Results) -> None:
    page = measurements_page(results)
    for section in survey(results):
        assert page.count(f"## {section.title}\n") == 1
    modes = [cells[0] for cells in tables(page)]
    for row in results.rows:
        assert row.mode.replace("<", r"\<") in modes


def test_a_disturbed_row_is_marked(results: Results) -> None:
    noisy = msgspec.structs.replace(results.rows[0], time_s=Times(min=1.5, median=2.5))
    assert "| ~1.5 s |" in measurements_page(Results(rows=[noisy]))


def test_words_make_no_columns_and_no_markup() -> None:
    table = Table("", ("a", "b"), [("x|y", "<b>*")], frozenset({0}))
    assert markdown_table(table).splitlines() == [
        "| a | b |",
        "| --- | ---: |",
        r"| x\|y | \<b>\* |",
    ]
