"""Run time against error: one picture for each scene, one panel for each quantity."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from benchmarks.schema import Row
from disk import whole_file

QUANTITIES = ("wall", "see-through", "shaded", "surface", "picture")
PANEL_INCHES = (3.8, 3.6)
COLORS = {
    "ART": "#b3321f",
    "ART live, 1 thread": "#b3321f",
    "VTK fixed-point": "#4d4d4d",
    "VTK fixed-point, against itself": "#4d4d4d",
    "VTK splats, depth-sorted": "#9a9a9a",
    "FSR gaussian": "#1f6fb3",
    "FSR points": "#7fb2dc",
    "FSR surfels": "#1f6fb3",
    "FSR live, 1 thread": "#1f6fb3",
    "FSR live, 2 threads": "#7fb2dc",
}


def draw_charts(rows: Iterable[Row], folder: Path) -> list[Path]:
    """Draw ``SCENE.png`` and ``SCENE.svg`` for every scene among the rows.

    Horizontal: CPU milliseconds of one picture. Vertical: RMSE against the row's
    reference. Nearer to the lower left corner is better. Rows of no series have no
    curve to be on and are left out. Gives the files.
    """
    scenes: dict[str, list[Row]] = {}
    for row in rows:
        scene, _, rest = row.case.partition("/")
        is_drawn = row.rmse and "series" in row.settings
        if is_drawn and rest.partition("/")[2] in QUANTITIES:
            scenes.setdefault(scene, []).append(row)
    files = []
    for scene, found in scenes.items():
        files += _save(_figure(scene, found), folder / scene)
    return files


def panels(rows: list[Row]) -> dict[tuple[str, str], dict[str, list[Row]]]:
    """Sort rows into (view, quantity), then into series, coarse steps first."""
    found: dict[tuple[str, str], dict[str, list[Row]]] = {}
    for row in rows:
        _, view, quantity = row.case.split("/")
        series = found.setdefault((view, quantity), {})
        series.setdefault(f"{row.settings['series']}", []).append(row)
    for series in found.values():
        for points in series.values():
            points.sort(key=lambda row: -float(row.settings.get("step_voxels", 0)))
    return found


def _figure(scene: str, rows: list[Row]) -> Any:
    from matplotlib.figure import Figure

    found = panels(rows)
    views = sorted({view for view, _ in found})
    quantities = [q for q in QUANTITIES if any(q == other for _, other in found)]
    figure = Figure(
        figsize=(PANEL_INCHES[0] * len(quantities), PANEL_INCHES[1] * len(views) + 0.4),
        layout="constrained",
    )
    figure.suptitle(f"{scene}: run time against error (lower left is better)")
    grid = figure.subplots(len(views), len(quantities), squeeze=False)
    for i, view in enumerate(views):
        for j, quantity in enumerate(quantities):
            series = found.get((view, quantity))
            if series is None:
                grid[i][j].set_axis_off()
            else:
                _draw_panel(grid[i][j], f"{view}, {quantity}", series)
    return figure


def _draw_panel(axes: Any, title: str, series: dict[str, list[Row]]) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for name, points in series.items():
        # The same measurement may stand in two suites, as one's baseline.
        unique = {p.mode: p for p in points}.values()
        axes.plot(
            [1e3 * p.cpu_s for p in unique],
            [p.rmse for p in unique],
            marker="o",
            markersize=5,
            linewidth=1.5,
            label=name,
            color=COLORS.get(name),
        )
        for p in unique:
            step = p.settings.get("step_voxels")
            if step is not None:
                axes.annotate(
                    f"{step:g}",
                    (1e3 * p.cpu_s, p.rmse),
                    xytext=(4, 4),
                    textcoords="offset points",
                    fontsize=7,
                    color="#666666",
                )
    sizes = {p.settings["size"] for points in series.values() for p in points}
    unit = next(p.error_unit for points in series.values() for p in points)
    axes.set(xscale="log", yscale="log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.set_title(f"{title}, {'/'.join(map(str, sizes))} px", fontsize=9)
    axes.set_xlabel("CPU ms a picture; figures: step in voxels", fontsize=8)
    axes.set_ylabel(f"RMSE, {unit}", fontsize=8)
    axes.tick_params(labelsize=7, which="both")
    axes.grid(visible=True, which="both", linewidth=0.3, color="#dddddd")
    axes.margins(0.2)
    axes.legend(
        fontsize=7,
        frameon=False,
        ncols=2,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.2),
    )


def _save(figure: Any, stem: Path) -> list[Path]:
    files = []
    for kind in ("png", "svg"):
        path = stem.with_suffix(f".{kind}")
        with whole_file(path) as beside:
            figure.savefig(beside, format=kind, dpi=130)
        files.append(path)
    return files
