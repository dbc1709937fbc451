"""A pass mark by the contrasting-groups method, with its confidence.

The scores of those who cannot do it yet and of those who can are taken as normally
distributed; the mark is where both densities are equal (Livingston, Zieky, Passing
Scores, ETS 1982; Joergensen et al., Med. Teach. 40, 2018).
"""

import math
from collections.abc import Sequence
from statistics import NormalDist

import msgspec
import numpy as np
from numpy.typing import NDArray

from scenarios.metrics.value_text import value_text
from system import UserError

Doubles = NDArray[np.float64]

LEAST_SESSIONS = 3
"""Of each group: fewer tell nothing about its spread."""

DRAWS = 2000
_SEED = 19820101


class GroupFit(msgspec.Struct, frozen=True):
    """A group's number of values, mean and standard deviation."""

    count: int
    mean: float
    deviation: float


class PassMark(msgspec.Struct, frozen=True):
    """A pass mark.

    mark: the value; low, high: 95 % of the bootstrap's marks lie between. draws: of the
    bootstrap that gave a mark, of all. passes_above: experts have larger values.
    false_pass: share of novices beyond the mark, by the fitted normal, and
    false_fail: of experts short of it; observed_ as counted. remarks: in sentences.
    """

    mark: float
    low: float
    high: float
    draws: int
    all_draws: int
    passes_above: bool
    novices: GroupFit
    experts: GroupFit
    false_pass: float
    false_fail: float
    observed_false_pass: float
    observed_false_fail: float
    remarks: tuple[str, ...] = ()


def pass_mark(
    novices: Sequence[float], experts: Sequence[float], draws: int = DRAWS
) -> PassMark:
    """Return where two groups part.

    UserError where a group has too few values or no spread, where both have the same
    mean, or where no mark lies between the means. The same values give the same bits.
    """
    low, high = _values(novices, "novices"), _values(experts, "experts")
    first, second = _fit(low), _fit(high)
    for name, group in (("novices", first), ("experts", second)):
        if not group.deviation > 0.0:
            raise UserError(
                f"All {group.count} {name} have the value {group.mean:g}; a spread is "
                "needed to tell two groups apart."
            )
    mark = crossing(first, second)
    if mark is None:
        raise UserError(
            "The groups cannot be told apart: novices "
            f"{value_text(first.mean, first.deviation)}, experts "
            f"{value_text(second.mean, second.deviation)}; no mark lies between their "
            "means."
        )
    passes_above = second.mean > first.mean
    marks = _bootstrap(low, high, passes_above, draws)
    remarks = []
    if len(marks) < 0.95 * draws:
        remarks.append(
            f"Of {draws} draws {draws - len(marks)} had no mark: the groups overlap "
            "too much, or are too small."
        )
    ends = np.quantile(marks, (0.025, 0.975)) if len(marks) else (math.nan, math.nan)
    sign = 1.0 if passes_above else -1.0
    return PassMark(
        mark,
        float(ends[0]),
        float(ends[1]),
        len(marks),
        draws,
        passes_above,
        first,
        second,
        NormalDist().cdf(sign * (first.mean - mark) / first.deviation),
        NormalDist().cdf(sign * (mark - second.mean) / second.deviation),
        float(np.mean(sign * low >= sign * mark)),
        float(np.mean(sign * high < sign * mark)),
        tuple(remarks),
    )


def crossing(first: GroupFit, second: GroupFit) -> float | None:
    """Return where two normal densities are equal between their means, or None.

    ln n1(x) = ln n2(x) is a quadratic equation; for equal deviations the mark is the
    middle of the means.
    """
    shift = second.mean - first.mean
    if shift == 0.0:
        return None
    # in units of the first deviation, from the first mean
    span, ratio = shift / first.deviation, second.deviation / first.deviation
    # (ratio^2 - 1) u^2 + 2 span u - span^2 - 2 ratio^2 ln ratio = 0
    a, b = ratio**2 - 1.0, span
    c = -(span**2) - 2.0 * ratio**2 * math.log(ratio)
    inside = b * b - a * c
    if inside < 0.0:
        return None
    # the root that stays finite as the deviations become equal
    root = b + math.copysign(math.sqrt(inside), b)
    candidates = [-c / root] + ([] if a == 0.0 else [-root / a])
    between = [u for u in candidates if 0.0 < u / span < 1.0]
    return first.mean + between[0] * first.deviation if between else None


def _values(values: Sequence[float], name: str) -> Doubles:
    found = np.array(values, np.float64)
    if len(found) < LEAST_SESSIONS:
        raise UserError(
            f"The contrasting groups need at least {LEAST_SESSIONS} sessions each; of "
            f"the {name} {len(found)} have a value."
        )
    if not np.all(np.isfinite(found)):
        raise UserError(f"A value of the {name} is not finite.")
    return found


def _fit(values: Doubles) -> GroupFit:
    return GroupFit(len(values), float(values.mean()), float(values.std(ddof=1)))


def _bootstrap(
    novices: Doubles, experts: Doubles, passes_above: bool, draws: int
) -> Doubles:
    """Return the marks of groups drawn anew from the groups."""
    rng = np.random.default_rng(_SEED)
    marks = []
    for _ in range(draws):
        first = _fit(rng.choice(novices, len(novices)))
        second = _fit(rng.choice(experts, len(experts)))
        if not (first.deviation > 0.0 and second.deviation > 0.0):
            continue
        mark = crossing(first, second)
        if mark is not None and (second.mean > first.mean) == passes_above:
            marks.append(mark)
    return np.array(marks)
