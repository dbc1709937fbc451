"""The results as a page of Markdown, which `docs/measurements.md` is a copy of."""

from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

from benchmarks.schema import Results, Row
from disk import whole_file

HEAD = """\
# Measurements

Made by `paravol bench`, which writes this page beside its results. *time*: the least of
the repeats, wall clock. *ratio*: the baseline's time over the row's own, both taken in
this run; above 1 is faster than the baseline. *RMSE* and *99.9 %*: the error against
the row's reference, in the unit named. `~` marks a row that something else disturbed.
"""

COLUMNS = ("mode", "time", "ratio", "RMSE", "99.9 %", "unit")


def measurements_page(results: Results) -> str:
    """Lay out all rows, a heading for each suite and a table for each case."""
    parts = [HEAD, *_machines(results.rows)]
    # A run that went on added its rows at the end: sorting brings a case together.
    rows = sorted(results.rows, key=lambda row: (row.suite, row.case))
    for suite, of_suite in groupby(rows, key=lambda row: row.suite):
        parts.append(f"## {suite}\n")
        for case, of_case in groupby(of_suite, key=lambda row: row.case):
            parts += [f"**{case}**\n", _table(of_case)]
    if results.skipped:
        parts.append("## Not measured\n")
        reasons = sorted({(skip.suite, skip.reason) for skip in results.skipped})
        parts.append("\n".join(f"- {suite}: {why}" for suite, why in reasons) + "\n")
    return "\n".join(parts)


def write_measurements(results: Results, folder: Path) -> Path:
    """Write ``measurements.md`` into `folder` as a whole and return its path."""
    path = folder / "measurements.md"
    with whole_file(path) as beside:
        beside.write_text(measurements_page(results), encoding="utf-8")
    return path


def _machines(rows: Iterable[Row]) -> Iterator[str]:
    seen = {
        f"{row.machine.cpu}, {row.machine.cores} cores, "
        f"{row.machine.memory_gib:.0f} GiB; sources {row.commit}; "
        f"numba {row.versions.get('numba', '?')}"
        for row in rows
    }
    yield from (f"Machine: {text}.\n" for text in sorted(seen))


def _table(rows: Iterable[Row]) -> str:
    lines = [" | ".join(COLUMNS), " | ".join(["---"] + ["---:"] * 4 + ["---"])]
    lines += [" | ".join(_cells(row)) for row in rows]
    return "\n".join(f"| {line} |" for line in lines) + "\n"


def _cells(row: Row) -> tuple[str, ...]:
    mark = "~" if row.is_noisy else ""
    return (
        row.mode.replace("|", r"\|"),
        mark + _duration(row.time_s.min),
        "" if row.ratio is None else f"{row.ratio:.3g}",
        "" if row.rmse is None else f"{row.rmse:.2e}",
        "" if row.p999 is None else f"{row.p999:.2e}",
        row.error_unit or "",
    )


def _duration(seconds: float) -> str:
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"
