"""Tables and figures of the simulated ranks, beside the paper's."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from benchmarks.reporting.pages import markdown_table
from benchmarks.reporting.section import Table
from benchmarks.schema import Row
from system import whole_file

SUITE = "art-scaling"
PAPER_KNEE = 2.5
PAPER_PLATEAU_S = 560.0

COLUMNS = {
    "simulated s": ("simulated_s", "{:.4g}"),
    "paper s": ("paper_s", "{:.0f}"),
    "cold frame s": ("cold_frame_s", "{:.3g}"),
    "efficiency": ("efficiency", "{:.1%}"),
    "paper": ("paper_efficiency", "{:.1%}"),
    "overhead": ("overhead", "{:.2%}"),
    "LRU, counted (paper 2.5 %)": ("share_lru", "{:.1%}"),
    "scan": ("share_scan", "{:.1%}"),
    "idle": ("share_idle", "{:.1%}"),
    "fetches a frame": ("cells_fetched_a_frame", "{:.0f}"),
    "owners moved": ("owners_moved", "{:.0f}"),
    "messages a frame": ("messages_a_frame", "{:.0f}"),
    "MB a frame": ("mb_a_frame", "{:.1f}"),
    "hops a cell": ("hops_a_cell", "{:.2f}"),
    "slots": ("slots", "{:.0f}"),
}
"""By the words above a column: a row's counter and its form."""


def report_scaling(rows: Iterable[Row], folder: Path) -> list[Path]:
    """Write ``art-scaling.md`` and ``.png`` when the suite has rows; give the files."""
    cases: dict[str, list[Row]] = {}
    for row in rows:
        if row.suite == SUITE:
            cases.setdefault(row.case, []).append(row)
    if not cases:
        return []
    text, picture = (folder / f"{SUITE}.{kind}" for kind in ("md", "png"))
    with whole_file(text) as beside:
        beside.write_text(_report(cases), encoding="utf-8")
    with whole_file(picture) as beside:
        _figure(cases).savefig(beside, format="png", dpi=130)
    return [text, picture]


def knee(rows: list[Row]) -> float:
    """Return the smallest cache whose time is at most 1.02 times the plateau's."""
    ordered = sorted(rows, key=lambda row: row.counters["cache"])
    plateau = ordered[-1].counters["simulated_s"]
    return min(
        row.counters["cache"]
        for row in ordered
        if row.counters["simulated_s"] <= 1.02 * plateau
    )


def _report(cases: dict[str, list[Row]]) -> str:
    parts = [
        "# Ranks on simulated machines\n\nAll seconds are simulated; `t3d` is the "
        "paper's machine.\n"
    ]
    for case, rows in cases.items():
        shared = dict(rows[0].settings)
        for row in rows[1:]:
            shared = {k: v for k, v in shared.items() if row.settings.get(k) == v}
        told = ", ".join(f"{name} {value}" for name, value in shared.items())
        parts.append(f"\n## {case}\n\n{told}\n\n")
        if case.startswith("figure4"):
            parts.append(
                f"Knee {knee(rows):g} volumes (paper about {PAPER_KNEE:g}; its plateau "
                f"{PAPER_PLATEAU_S:.0f} s).\n\n"
            )
        parts.append(_table(rows))
    return "".join(parts)


def _table(rows: list[Row]) -> str:
    """Lay out the columns that any of the rows has a figure for."""
    used = {
        name: told
        for name, told in COLUMNS.items()
        if any(row.counters.get(told[0]) for row in rows)
    }
    cells = []
    for row in rows:
        figures = [
            form.format(row.counters[key]) if key in row.counters else ""
            for key, form in used.values()
        ]
        cells.append((row.mode, *figures))
    return markdown_table(Table("", ("", *used), cells))


def _figure(cases: dict[str, list[Row]]) -> Any:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.6, 3.8), layout="constrained")
    caches, speeds = figure.subplots(1, 2)
    for case, rows in cases.items():
        kind, what, _ = case.split("/")
        if kind == "figure4":
            rows = sorted(rows, key=lambda row: row.counters["cache"])
            x = [row.counters["cache"] for row in rows]
            caches.plot(x, [r.counters["simulated_s"] for r in rows], "o-", label=what)
        x = [float(row.settings["ranks"]) for row in rows]
        if kind == "table1" and "1.41" in what:
            side = what.split(",")[0]
            for name, style in (("efficiency", "o-"), ("paper_efficiency", "x--")):
                y = [n * r.counters[name] for n, r in zip(x, rows, strict=True)]
                label = f"{side}³{', paper' if name.startswith('paper') else ''}"
                speeds.plot(x, y, style, label=label)
    caches.axhline(PAPER_PLATEAU_S, color="#999999", linewidth=0.8)
    caches.axvline(PAPER_KNEE, color="#999999", linewidth=0.8)
    caches.set(
        title="Figure 4: 60 frames, 8 ranks (grey: paper)",
        xlabel="all caches together / volume",
        ylabel="simulated s",
    )
    speeds.plot([1, 16], [1, 16], color="#999999", linewidth=0.8)
    speeds.set(title="Figure 5: speed-up", xlabel="ranks", ylabel="speed-up")
    for axes in (caches, speeds):
        axes.grid(visible=True, linewidth=0.3, color="#dddddd")
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=7, frameon=False)
    return figure
