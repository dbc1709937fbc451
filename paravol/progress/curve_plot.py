"""A learning curve as a picture."""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from paravol.progress.learning_curve import LearningCurve, PassRate
from system import UserError, whole_file
from system.plain_text import plain

FORMATS = (".png", ".svg")

_BLUE, _ORANGE = "#0072b2", "#d55e00"
"""Of Okabe and Ito's palette: told apart by those who see red as green."""


def require_format(file: Path) -> None:
    """Raise UserError unless a picture can be written by this name."""
    if file.suffix.lower() not in FORMATS:
        raise UserError(f"--out must name a .png or .svg file, got {file}.")


def draw_curve(
    file: Path,
    title: str,
    label: str,
    figures: Sequence[float],
    curve: LearningCurve | None,
    rates: Sequence[PassRate] = (),
) -> None:
    """Write the attempts, their curve with its band, and the moving pass rate.

    label: of the figure, with its unit. figures: by attempt. The same arguments give
    the same bytes.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    # a name between two dollars is no formula
    settings: Any = {"svg.hashsalt": "paravol", "text.parse_math": False}
    with rc_context(settings), warnings.catch_warnings():
        # letters that the font lacks are drawn as boxes
        warnings.filterwarnings("ignore", "Glyph")
        figure = Figure(figsize=(7.0, 5.4 if rates else 4.0), layout="constrained")
        ratios = [3, 1] if rates else [1]
        grid = figure.subplots(
            len(ratios), squeeze=False, sharex=True, height_ratios=ratios
        )
        axes = grid[0][0]
        figure.suptitle(plain(title))
        numbers = range(1, len(figures) + 1)
        axes.plot(numbers, figures, "o", color="black", label="attempts")
        if curve is not None:
            axes.fill_between(
                curve.attempts,
                curve.low,
                curve.high,
                color=_BLUE,
                alpha=0.2,
                label="90 % band of the curve",
            )
            axes.plot(curve.attempts, curve.middle, color=_BLUE, label=curve.shape)
        axes.set_ylabel(plain(label))
        axes.legend(frameon=False)
        if rates:
            below = grid[1][0]
            at = [rate.attempt for rate in rates]
            low = [100 * rate.low for rate in rates]
            high = [100 * rate.high for rate in rates]
            below.fill_between(at, low, high, color=_ORANGE, alpha=0.2)
            shares = [100 * r.share for r in rates]
            below.plot(at, shares, "s-", color=_ORANGE, markersize=4)
            below.set_ylim(-4, 104)
            below.set_ylabel("passed, %")
        grid[-1][0].set_xlabel("attempt")
        for row in grid:
            row[0].grid(alpha=0.25)
            row[0].xaxis.get_major_locator().set_params(integer=True)
        with whole_file(file) as beside:
            kind = file.suffix[1:].lower()
            metadata = {"Date": None} if kind == "svg" else {}
            figure.savefig(beside, format=kind, dpi=120, metadata=metadata)
