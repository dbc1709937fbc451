"""The results as one table on the terminal."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.schema import Results, Row

COLUMNS = (
    "suite",
    "case",
    "mode",
    "min ms",
    "median ms",
    "CPU ms",
    "ratio",
    "RMSE",
    "p99.9",
    "in",
)


def table_cells(row: Row) -> tuple[str, ...]:
    """Put one row into words, in the order of `COLUMNS`.

    ``~`` marks a measurement that something else disturbed.
    """
    mark = "~" if row.is_noisy else ""
    return (
        row.suite,
        row.case,
        row.mode,
        f"{1e3 * row.time_s.min:.1f}",
        f"{mark}{1e3 * row.time_s.median:.1f}",
        f"{1e3 * row.cpu_s:.1f}",
        "" if row.ratio is None else f"{row.ratio:.2f} ({row.clock})",
        "" if row.rmse is None else f"{row.rmse:.2e}",
        "" if row.p999 is None else f"{row.p999:.2e}",
        row.error_unit or "",
    )


def results_table(results: Results) -> Table:
    """Lay out all rows."""
    table = Table(
        *COLUMNS,
        title="Run time against error; ratio is the baseline's time over one's own",
        title_justify="left",
    )
    previous = None
    for row in results.rows:
        if previous not in (None, (row.suite, row.case)):
            table.add_section()
        previous = row.suite, row.case
        table.add_row(*table_cells(row))
    return table


def print_results(results: Results, path: Path, charts: list[Path]) -> None:
    """Print the table, what was skipped and why, and where everything is."""
    console = Console()
    console.print(results_table(results), highlight=False)
    reasons: dict[tuple[str, str], int] = {}
    for skip in results.skipped:
        key = skip.suite, skip.reason
        reasons[key] = reasons.get(key, 0) + 1
    for (suite, reason), count in reasons.items():
        console.print(f"{suite}: {count} skipped: {reason}", highlight=False)
    for file in (path, *charts):
        console.print(str(file), highlight=False)
