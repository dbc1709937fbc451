"""The results as one table on the terminal."""

import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.schema import Results, Row, results_text

COLUMNS = ("mode", "min ms", "median ms", "CPU ms", "ratio", "RMSE", "p99.9", "in")
LOG_WIDTH = 140
"""Columns of a table that goes to a file, where nobody has told a width."""


def table_cells(row: Row) -> tuple[str, ...]:
    """Put one row into words, in the order of `COLUMNS`.

    ``~`` marks a measurement that something else disturbed.
    """
    mark = "~" if row.is_noisy else ""
    return (
        f"  {row.mode}",
        f"{1e3 * row.time_s.min:.1f}",
        f"{mark}{1e3 * row.time_s.median:.1f}",
        f"{1e3 * row.cpu_s:.1f}",
        "" if row.ratio is None else f"{row.ratio:.3g} {row.clock}",
        "" if row.rmse is None else f"{row.rmse:.2e}",
        "" if row.p999 is None else f"{row.p999:.2e}",
        row.error_unit or "",
    )


def further_cells(row: Row) -> list[tuple[str, ...]]:
    """Tell the errors beside the row's own, a line each."""
    return [
        (f"    {name}", "", "", "", "", f"{rmse:.2e}", "", row.error_unit or "")
        for name, rmse in row.further_rmse.items()
    ]


def results_table(results: Results) -> Table:
    """Lay out all rows, one section for each case."""
    table = Table(
        title="Run time against error; ratio: the baseline's time over one's own",
        title_justify="left",
    )
    for column in COLUMNS:
        table.add_column(
            column,
            justify="left" if column in ("mode", "in") else "right",
            no_wrap=True,
        )
    previous = None
    for row in results.rows:
        if previous != (row.suite, row.case):
            table.add_section()
            table.add_row(f"{row.suite}: {row.case}", style="bold")
        previous = row.suite, row.case
        table.add_row(*table_cells(row))
        for cells in further_cells(row):
            table.add_row(*cells)
    return table


def print_results(
    results: Results, written: list[Path], *, as_json: bool = False
) -> None:
    """Print the table, what was skipped and why, and where everything is.

    as_json: print what the results file says instead.
    """
    if as_json:
        print(results_text(results), end="")
        return
    console = Console(width=None if sys.stdout.isatty() else LOG_WIDTH)
    console.print(results_table(results), highlight=False)
    reasons: dict[tuple[str, str], int] = {}
    for skip in results.skipped:
        key = skip.suite, skip.reason
        reasons[key] = reasons.get(key, 0) + 1
    lines = [
        f"{suite}: {count} skipped: {reason}"
        for (suite, reason), count in reasons.items()
    ]
    for line in (*lines, *map(str, written)):
        console.print(line, highlight=False, soft_wrap=True)
