"""Charts whose axes are both logarithmic, as pictures that stand in a page."""

import base64
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

SIZE_IN = 5.6, 4.0

FAMILIES = {"ART": "Reds", "FSR": "Blues", "VTK": "Greys"}
"""Colours of series by who made them. Markers and dashes tell again what they tell."""

OTHERS = "YlOrBr"
MARKERS = "osD^vP"
DASHES = "-", "--", ":", "-."


@dataclass(frozen=True, slots=True)
class Curve:
    """A series of points. is_line: they are joined."""

    name: str
    points: Sequence[tuple[float, float]]
    is_line: bool = True


def log_chart(
    across: str,
    up: str,
    curves: Sequence[Curve],
    *,
    front: Sequence[tuple[float, float]] = (),
    slopes: Sequence[tuple[float, str]] = (),
) -> str:
    """Draw curves; give the picture as a ``data:`` address, the same for the same.

    front: its corners, fastest first. slopes: guides with their words.
    """
    from matplotlib import rc_context

    written = io.BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "", "font.size": 8}):
        figure = log_figure(across, up, curves, front=front, slopes=slopes)
        figure.savefig(written, format="svg", metadata={"Date": None})
    return f"data:image/svg+xml;base64,{base64.b64encode(written.getvalue()).decode()}"


def log_figure(
    across: str,
    up: str,
    curves: Sequence[Curve],
    *,
    front: Sequence[tuple[float, float]] = (),
    slopes: Sequence[tuple[float, str]] = (),
) -> Any:
    """Return what `log_chart` writes, a matplotlib figure."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_IN, layout="constrained")
    axes = figure.add_subplot(xscale="log", yscale="log", xlabel=across, ylabel=up)
    axes.grid(visible=True, linewidth=0.4)
    looks = styles([curve.name for curve in curves])
    for curve, look in zip(curves, looks, strict=True):
        if not curve.is_line:
            look = look | {"linestyle": ""}
        axes.plot(*zip(*curve.points, strict=True), label=curve.name, **look)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    axes.autoscale(enable=False)
    for number, (slope, name) in enumerate(slopes):
        dots = 0, (1, 2 + 3 * number)
        middle = (low * high) ** 0.5
        reach = (right / left) ** (slope / 2)
        ends = middle / reach, middle * reach
        axes.plot((left, right), ends, color="#777777", linestyle=dots, label=name)
    if front:
        x, y = zip(*front, strict=True)
        corners = (x[0], *x, right), (high, *y, y[-1])
        axes.plot(
            *corners,
            drawstyle="steps-post",
            color="#1a6b3c",
            linewidth=5,
            alpha=0.3,
            label="front",
        )
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return figure


def styles(names: Sequence[str]) -> list[dict[str, Any]]:
    """Give each series a look of its own, alike for the same maker."""
    from matplotlib import colormaps

    found = []
    counts: Counter[str] = Counter()
    for name in names:
        family = FAMILIES.get(name.partition(" ")[0].rstrip(","), OTHERS)
        n = counts[family]
        counts[family] += 1
        found.append(
            {
                "color": colormaps[family](0.95 - 0.1 * (n % 6)),
                "marker": MARKERS[n % len(MARKERS)],
                "linestyle": DASHES[n % len(DASHES)],
                "linewidth": 1.2,
                "markersize": 4,
            }
        )
    return found
