"""What bounds a renderer, and its share of that: as far as the rows tell."""

from collections.abc import Callable, Iterable, Sequence

from benchmarks.reporting.section import Cells, Table
from benchmarks.schema import Row

FRAGMENT = "ns per fragment, frame"


def limit_tables(rows: Sequence[Row]) -> list[Table]:
    """Lay out the samples of rays, the fragments of splats, and threads."""
    found = [
        Table(
            "Rays: nanoseconds of a sample that contributes; the limit is what value "
            "and gradient take from the nearest cache, one sample after another",
            ("who", "picture", "ns a sample", "limit, ns", "share of the limit"),
            _cells(rows, "share_of_limit", _sample),
            frozenset({0, 1}),
        ),
        Table(
            "Splats: nanoseconds of a fragment, culling and sorting among them",
            ("who", "picture", "fragments", "ns a fragment"),
            _cells(rows, FRAGMENT, _fragment),
            frozenset({0, 1}),
        ),
        Table(
            "Threads: the limit is as many times faster as there are threads",
            ("who", "picture", "threads", "times faster", "share of the limit"),
            [_threads(row) for row in rows if _is_threaded(row)],
            frozenset({0, 1}),
        ),
    ]
    return [table for table in found if table.rows]


def _cells(
    rows: Iterable[Row], counter: str, cells: Callable[[Row], Cells]
) -> list[Cells]:
    return [cells(row) for row in rows if counter in row.counters]


def _sample(row: Row) -> Cells:
    told = row.counters
    return (
        row.mode,
        row.case,
        f"{told['ns_per_contributing']:.3g}",
        f"{told['limit_ns_per_contributing']:.3g}",
        f"{told['share_of_limit']:.0%}",
    )


def _fragment(row: Row) -> Cells:
    told = row.counters
    count = f"{told['fragments']:,.0f}"
    return row.mode, row.case, count, f"{told[FRAGMENT]:.3g}"


def _threads(row: Row) -> Cells:
    assert row.ratio is not None
    threads = int(row.settings["threads"])
    share = f"{row.ratio / threads:.0%}"
    return row.mode, row.case, f"{threads}", f"{row.ratio:.3g}", share


def _is_threaded(row: Row) -> bool:
    """Return whether a row compares several threads with one of the same code."""
    threads = row.settings.get("threads", 1)
    return (
        row.ratio is not None
        and row.clock == "wall"
        and isinstance(threads, int)
        and threads > 1
        and "thread" in row.mode
    )
