"""The skipping ledger: what was left out, what that saved, and what proves it right."""

from collections.abc import Iterable

from benchmarks.losslessness import COMPARED, DIFFER
from benchmarks.reporting.section import Cells, Table
from benchmarks.schema import Row


def skipping_table(rows: Iterable[Row]) -> Table:
    """Lay out rows that skip something, beside the rows that do not."""
    found = [row for row in rows if "skips" in row.settings]
    return Table(
        "Each row beside the same work without skipping, measured in the same run; the "
        "proof compares all values bit for bit",
        ("skipped", "how", "case", "time saved", "times faster", "proof"),
        [_cells(row) for row in found],
        frozenset({0, 1, 2, 5}),
        frozenset(n for n, row in enumerate(found) if not is_lossless(row)),
    )


def is_lossless(row: Row) -> bool:
    """Return whether a row compared its values and none differed."""
    compared = row.counters.get(COMPARED, 0)
    return compared > 0 and row.counters.get(DIFFER, compared) == 0


def _cells(row: Row) -> Cells:
    compared = row.counters.get(COMPARED, 0)
    proof = f"{row.counters.get(DIFFER, 0):,.0f} of {compared:,.0f} values differ"
    saved = "" if row.ratio is None else f"{1 - 1 / row.ratio:.0%}"
    return (
        f"{row.settings['skips']}",
        row.mode,
        row.case,
        saved,
        "" if row.ratio is None else f"{row.ratio:.3g}",
        proof if compared else "nothing was compared",
    )
