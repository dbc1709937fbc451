"""The results in sections: page and documents take all that they say from here."""

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import groupby

from benchmarks.losslessness import COMPARED, DIFFER
from benchmarks.reporting.fronts import Comparison, comparisons
from benchmarks.reporting.growth import CONFIDENCE, Sweep, sweeps
from benchmarks.reporting.log_chart import Curve, log_chart
from benchmarks.reporting.section import Cells, Chart, Section, Table, duration
from benchmarks.schema import Results, Row

ORDERS = (-1.0, "order 1"), (-2.0, "order 2")
"""Error against time where halving a step doubles the time."""

ROW_COLUMNS = ("mode", "time", "ratio", "RMSE", "99.9 %", "unit")


def survey(results: Results) -> list[Section]:
    """Return all sections; those that nothing was measured for say so."""
    # A run that went on added its rows at the end: sorting brings a case together.
    rows = sorted(results.rows, key=lambda row: (row.suite, row.case))
    compared = comparisons(rows)
    return [
        _made(results),
        _errors(compared),
        _fronts(compared),
        _growth(sweeps(rows)),
        _skipping(rows),
        *_suites(rows),
        _missing(results),
    ]


def _made(results: Results) -> Section:
    rows = results.rows
    machines = sorted(
        {
            (
                f"{row.machine.cpu}, {row.machine.cores} cores, "
                f"{row.machine.memory_gib:.0f} GiB",
                row.machine.system,
                row.commit,
            )
            for row in rows
        }
    )
    versions = sorted({pair for row in rows for pair in row.versions.items()})
    loads = [row.machine.load for row in rows]
    section = Section("machine", "Machine, versions, sources")
    if not rows:
        section.words.append("Nothing was measured.")
        return section
    noisy = sum(row.is_noisy for row in rows)
    section.words.append(
        f"{len(rows)} rows, {noisy} of them disturbed: their median time is more than "
        f"a fifth above the least. Processes that wanted a core meanwhile: "
        f"{min(loads):.1f} to {max(loads):.1f}."
    )
    section.tables += [
        Table(
            "Where it ran",
            ("machine", "system", "sources"),
            machines,
            frozenset(range(3)),
        ),
        Table("Versions", ("library", "version"), versions, frozenset(range(2))),
    ]
    return section


def _errors(compared: Sequence[Comparison]) -> Section:
    section = Section(
        "errors",
        "Run time against error",
        [
            "Lower left is better. Time: CPU time of one picture on one thread; wall "
            "clock for more threads, which are no part of the front. Error: root mean "
            "square against the reference named, in the unit named. Dotted: errors "
            "that fall with the first and the second power of the time."
        ],
    )
    for panel in compared:
        note = f"Reference: {panel.reference}."
        if panel.own_reference:
            names = ", ".join(sorted(panel.own_reference))
            note += f" Against its own finest picture instead: {names}."
        picture = log_chart(
            "ms a picture",
            f"RMSE, {panel.unit}",
            [_curve(name, rows) for name, rows in panel.series.items()],
            front=[(1e3 * row.seconds, row.rmse or 0.0) for row in panel.front],
            slopes=ORDERS,
        )
        section.charts.append(Chart(f"{panel.title}. {note}", picture))
    return _or_nothing(section)


def _curve(name: str, rows: Sequence[Row]) -> Curve:
    points = [(1e3 * row.seconds, row.rmse or 0.0) for row in rows]
    return Curve(name, points, is_line=all("step_voxels" in r.settings for r in rows))


def _fronts(compared: Sequence[Comparison]) -> Section:
    section = Section(
        "fronts",
        "Who is on the front",
        ["Nothing on one thread equals or beats these in both time and error."],
    )
    told = Counter(panel.title for panel in compared)
    section.tables = [
        Table(
            panel.title if told[panel.title] == 1 else _against(panel),
            ("who", "time", f"RMSE, {panel.unit}"),
            [
                (row.mode, duration(row.seconds), f"{row.rmse:.2e}")
                for row in panel.front
            ],
        )
        for panel in compared
        if panel.front
    ]
    return _or_nothing(section)


def _against(panel: Comparison) -> str:
    return f"{panel.title}, against {panel.reference}"


def _growth(found: Sequence[Sweep]) -> Section:
    section = Section(
        "growth",
        "How cost grows",
        [
            "A power of the amount fitted to the least times: 1 is in proportion. The "
            f"interval has {CONFIDENCE:.0%} confidence, from how the points scatter "
            "about the fit; two points give none."
        ],
    )
    by_amount = sorted(found, key=lambda sweep: sweep.grows_with)
    for name, alike in groupby(by_amount, key=lambda sweep: sweep.grows_with):
        curves = [
            Curve(
                f"{sweep.series}: {sweep.case.split('/')[1]}",
                [
                    (at, 1e3 * row.seconds)
                    for at, row in zip(sweep.amounts, sweep.rows, strict=True)
                ],
            )
            for sweep in alike
        ]
        picture = log_chart(name, "ms", curves, slopes=((1.0, "power 1"),))
        section.charts.append(Chart(f"Time against {name}", picture))
    cells = [_power(sweep) for sweep in by_amount]
    head = ("who", "case", "grows with", "from", "to", "points", "exponent", "interval")
    if cells:
        section.tables.append(Table("Exponents", head, cells, frozenset({0, 1, 2})))
    return _or_nothing(section)


def _power(sweep: Sweep) -> Cells:
    power = sweep.power
    interval = "not known"
    if power.half_width is not None:
        low, high = (power.exponent + s * power.half_width for s in (-1, 1))
        interval = f"{low:.2f} to {high:.2f}"
    return (
        sweep.series,
        sweep.case,
        sweep.grows_with,
        f"{sweep.amounts[0]:,.12g}",
        f"{sweep.amounts[-1]:,.12g}",
        f"{len(sweep.rows)}",
        f"{power.exponent:.2f}",
        interval,
    )


def _skipping(rows: Sequence[Row]) -> Section:
    section = Section("skipping", "What is skipped")
    table = skipping_table(rows)
    if table.rows:
        section.words.append(
            f"{len(table.rows) - len(table.bad)} of {len(table.rows)} lose nothing: "
            "every value has the bits that it has without skipping."
        )
        section.tables.append(table)
    return _or_nothing(section)


def skipping_table(rows: Iterable[Row]) -> Table:
    """Lay out rows that skip something, beside the rows that do not."""
    found = [row for row in rows if "skips" in row.settings]
    return Table(
        "Each row beside the same work without skipping, measured in the same run; the "
        "proof compares all values bit for bit",
        ("skipped", "how", "case", "time saved", "times faster", "proof"),
        [_skipping_cells(row) for row in found],
        frozenset({0, 1, 2, 5}),
        frozenset(n for n, row in enumerate(found) if not is_lossless(row)),
    )


def is_lossless(row: Row) -> bool:
    """Return whether a row compared its values and none differed."""
    compared = row.counters.get(COMPARED, 0)
    return compared > 0 and row.counters.get(DIFFER, compared) == 0


def _skipping_cells(row: Row) -> Cells:
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


def _suites(rows: Iterable[Row]) -> list[Section]:
    found = []
    for suite, of_suite in groupby(rows, key=lambda row: row.suite):
        section = Section(f"suite-{suite}", f"All rows of {suite}", is_long=True)
        for case, of_case in groupby(of_suite, key=lambda row: row.case):
            cells = [line for row in of_case for line in row_cells(row)]
            section.tables.append(Table(case, ROW_COLUMNS, cells, frozenset({0, 5})))
        found.append(section)
    return found


def row_cells(row: Row) -> list[Cells]:
    """Put one row into words, further errors in lines below it."""
    mark = "~" if row.is_noisy else ""
    own = (
        row.mode,
        mark + duration(row.time_s.min),
        "" if row.ratio is None else f"{row.ratio:.3g}",
        "" if row.rmse is None else f"{row.rmse:.2e}",
        "" if row.p999 is None else f"{row.p999:.2e}",
        row.error_unit or "",
    )
    unit = row.error_unit or ""
    further = [
        (f"\N{RIGHTWARDS ARROW} {name}", "", "", f"{rmse:.2e}", "", unit)
        for name, rmse in row.further_rmse.items()
    ]
    return [own, *further]


def _missing(results: Results) -> Section:
    section = Section("missing", "Not measured")
    reasons = sorted({(skip.suite, skip.reason) for skip in results.skipped})
    count = [sum((s.suite, s.reason) == r for s in results.skipped) for r in reasons]
    if reasons:
        cells = [(*r, f"{n}") for r, n in zip(reasons, count, strict=True)]
        head = ("suite", "why", "rows")
        section.tables.append(Table("Left out", head, cells, frozenset({0, 1})))
    else:
        section.words.append("Everything that was asked for was measured.")
    return section


def _or_nothing(section: Section) -> Section:
    if not section.tables and not section.charts:
        section.words = ["Nothing was measured of this."]
    return section
