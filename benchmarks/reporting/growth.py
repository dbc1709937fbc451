"""How cost grows: powers fitted to sweeps, each with its interval of confidence."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from benchmarks.schema import Row
from system import UserError

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Power:
    """Hold ``seconds = factor * amount ** exponent``.

    half_width: of the exponent's interval of confidence; None where two points leave
    nothing to judge the fit by.
    """

    exponent: float
    factor: float
    half_width: float | None


@dataclass(frozen=True, slots=True)
class Sweep:
    """Rows that differ in one amount, the smallest first."""

    case: str
    series: str
    grows_with: str
    rows: Sequence[Row]

    @property
    def amounts(self) -> list[float]:
        """Return what was changed, as far."""
        return [amount(row) for row in self.rows]

    @property
    def power(self) -> Power:
        """Return the fit to the times."""
        return fit(self.amounts, [row.seconds for row in self.rows])


def sweeps(rows: Iterable[Row]) -> list[Sweep]:
    """Find the sweeps among rows: those that tell what they grow with, two or more."""
    found: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        told = row.settings
        if "grows_with" in told:
            key = row.case, f"{told['series']}", f"{told['grows_with']}"
            found.setdefault(key, []).append(row)
    return [
        Sweep(*key, sorted(points, key=amount))
        for key, points in found.items()
        if len({amount(row) for row in points}) > 1
    ]


def amount(row: Row) -> float:
    """Return how much there was of what a row grows with."""
    return float(row.settings["amount"])


def fit(amounts: Sequence[float], seconds: Sequence[float]) -> Power:
    """Fit a line to logarithms by least squares.

    The interval is Student's, of the slope, for independent errors of the logarithms
    (Draper and Smith, Applied Regression Analysis, 1.4). Raises UserError for fewer
    than two different amounts.
    """
    if len(set(amounts)) < 2 or min(*amounts, *seconds) <= 0:
        raise UserError("a power needs two different positive amounts and their times")
    x, y = np.log(np.asarray(amounts, float)), np.log(np.asarray(seconds, float))
    away = x - x.mean()
    spread = float(away @ away)
    slope = float(away @ y) / spread
    level = float(y.mean() - slope * x.mean())
    free = len(x) - 2
    half_width = None
    if free > 0:
        left = y - level - slope * x
        error = float(np.sqrt(left @ left / free / spread))
        half_width = float(stats.t.ppf(0.5 + CONFIDENCE / 2, free)) * error
    return Power(slope, float(np.exp(level)), half_width)
