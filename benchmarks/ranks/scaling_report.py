"""Tables and figures of the simulated ranks, beside the paper's."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from benchmarks.schema import Row
from disk import whole_file

SUITE = "art-scaling"
NAME = "art-scaling"
PAPER_KNEE = 2.5
PAPER_PLATEAU_S = 560.0


def report_scaling(rows: Iterable[Row], folder: Path) -> list[Path]:
    """Write ``art-scaling.md`` and ``.png`` when the suite has rows; give the files."""
    cases: dict[str, list[Row]] = {}
    for row in rows:
        if row.suite == SUITE:
            cases.setdefault(row.case, []).append(row)
    if not cases:
        return []
    text = folder / f"{NAME}.md"
    with whole_file(text) as beside:
        beside.write_text(_report(cases), encoding="utf-8")
    picture = folder / f"{NAME}.png"
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
        "paper's machine, `today` a cluster of today's cores.\n"
    ]
    for case, rows in cases.items():
        kind = case.split("/")[0]
        parts.append(f"\n## {case}\n\n{_settings(rows)}\n\n")
        if kind == "table1":
            columns = {
                "simulated s": ("simulated_s", "{:.0f}"),
                "paper s": ("paper_s", "{:.0f}"),
                "efficiency %": ("efficiency", "{:.1%}"),
                "paper %": ("paper_efficiency", "{:.1%}"),
                "overhead": ("overhead", "{:.2%}"),
                "LRU, counted (paper 2.5 %)": ("share_lru", "{:.1%}"),
                "idle": ("share_idle", "{:.1%}"),
                "fetches a frame": ("cells_fetched_a_frame", "{:.0f}"),
            }
        elif kind == "figure4":
            columns = {
                "simulated s": ("simulated_s", "{:.0f}"),
                "fetches a frame": ("cells_fetched_a_frame", "{:.0f}"),
                "scan": ("share_scan", "{:.1%}"),
                "owners moved": ("owners_moved", "{:.0f}"),
            }
            parts.append(
                f"Knee {knee(rows):g} volumes (paper about {PAPER_KNEE:g}; its plateau "
                f"{PAPER_PLATEAU_S:.0f} s).\n\n"
            )
        elif kind == "ways":
            columns = {
                "simulated s": ("simulated_s", "{:.4g}"),
                "cold frame s": ("cold_frame_s", "{:.3g}"),
                "overhead": ("overhead", "{:.2%}"),
                "idle": ("share_idle", "{:.1%}"),
                "fetches a frame": ("cells_fetched_a_frame", "{:.0f}"),
                "rays sent": ("rays_sent_a_frame", "{:.0f}"),
                "messages a frame": ("messages_a_frame", "{:.0f}"),
                "MB a frame": ("mb_a_frame", "{:.1f}"),
                "hops a cell": ("hops_a_cell", "{:.2f}"),
                "slots": ("slots", "{:.0f}"),
            }
        else:
            columns = {
                "frames drawn": ("frames_efficiency", "{:.1%}"),
                "cold": ("cold_efficiency", "{:.1%}"),
                "warm": ("warm_efficiency", "{:.1%}"),
                "balance allows": ("balance_limit", "{:.1%}"),
                "overhead": ("overhead", "{:.2%}"),
                "idle": ("share_idle", "{:.1%}"),
                "fetches a frame": ("cells_fetched_a_frame", "{:.0f}"),
                "hops a cell": ("hops_a_cell", "{:.2f}"),
                "slots": ("slots", "{:.0f}"),
            }
        parts.append(_table(rows, columns))
    return "".join(parts)


def _settings(rows: list[Row]) -> str:
    """Say what the rows have in common."""
    shared = dict(rows[0].settings)
    for row in rows[1:]:
        shared = {k: v for k, v in shared.items() if row.settings.get(k) == v}
    return ", ".join(f"{name} {value}" for name, value in shared.items())


def _table(rows: list[Row], columns: dict[str, tuple[str, str]]) -> str:
    lines = ["| | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for row in rows:
        cells = [
            form.format(row.counters[key]) if key in row.counters else ""
            for key, form in columns.values()
        ]
        lines.append(f"| {row.mode} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _figure(cases: dict[str, list[Row]]) -> Any:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.4, 3.8), layout="constrained")
    caches, speeds, many = figure.subplots(1, 3)
    for case, rows in cases.items():
        kind, what, machine = case.split("/")
        if kind == "figure4":
            rows = sorted(rows, key=lambda row: row.counters["cache"])
            x = [row.counters["cache"] for row in rows]
            caches.plot(x, [r.counters["simulated_s"] for r in rows], "o-", label=what)
        elif kind == "table1" and "1.41" in what:
            x = [float(row.settings["ranks"]) for row in rows]
            side = what.split(",")[0]
            for name, key, style in (
                (f"{side}³, simulated", "efficiency", "o-"),
                (f"{side}³, paper", "paper_efficiency", "x--"),
            ):
                y = [n * r.counters[key] for n, r in zip(x, rows, strict=True)]
                speeds.plot(x, y, style, label=name)
        elif kind in ("strong", "weak"):
            x = [float(row.settings["ranks"]) for row in rows]
            y = [row.counters["efficiency"] for row in rows]
            many.plot(x, y, "o-", label=f"{kind}, {machine}")
    caches.axhline(PAPER_PLATEAU_S, color="#999999", linewidth=0.8)
    caches.axvline(PAPER_KNEE, color="#999999", linewidth=0.8)
    caches.set(
        title="Figure 4: 60 frames, 8 ranks (grey: paper)",
        xlabel="all caches together / volume",
        ylabel="simulated s",
    )
    speeds.plot([1, 16], [1, 16], color="#999999", linewidth=0.8)
    speeds.set(title="Figure 5: speed-up", xlabel="ranks", ylabel="speed-up")
    many.set(title="Many ranks", xlabel="ranks", ylabel="efficiency", xscale="log")
    many.set_ylim(0, 1.05)
    for axes in (caches, speeds, many):
        axes.title.set_fontsize(9)
        axes.tick_params(labelsize=7)
        axes.grid(visible=True, linewidth=0.3, color="#dddddd")
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=7, frameon=False)
    return figure
