"""How near tools came to what must not be hurt, how long, and what was entered."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from scenarios.metrics.episodes import held, intervals, weights
from scenarios.metrics.measured import HazardGaps, Measured
from scenarios.metrics.metric import (
    PATIENT,
    SCOPE,
    TOOL,
    Answer,
    Definition,
    Found,
    too_little,
)

Doubles = NDArray[np.float64]


_NOISE_MM = 1.0
"""Nearer than this to the largest distance that is stored, noise decides."""


def _of_hazards(
    measured: Measured,
    role: str,
    score: Callable[[Measured, Doubles, Doubles, float], Found],
) -> Answer:
    """Score the gaps to each hazard; a hazard without samples tells why."""
    gaps: HazardGaps | None
    gaps = measured.hazards if role == SCOPE else measured.tool_hazards
    if gaps is None:
        return {}
    found = {}
    for name, gap_mm in gaps.gap_mm.items():
        known = np.isfinite(gap_mm) & np.isfinite(gaps.time_s)
        if score is _smallest and known.any() and gap_mm[known].min() > _far(gaps):
            reason = f"nothing came nearer than {_far(gaps):.0f} mm"
            found[name] = Found(None, (), reason)
            continue
        if known.sum() < 2:
            found[name] = too_little("two samples are needed")
            continue
        margin = measured.settings.margin_of(name)
        found[name] = score(measured, gaps.time_s[known], gap_mm[known], margin)
    return found


def _far(gaps: HazardGaps) -> float:
    """Return the distance from which on gaps are cut off, noise included."""
    return gaps.farthest_mm - _NOISE_MM


def _smallest(
    measured: Measured, time_s: Doubles, gap_mm: Doubles, margin_mm: float
) -> Found:
    """Return the smallest distance and its moment."""
    at = int(np.argmin(gap_mm))
    return Found(float(gap_mm[at]), ((float(time_s[at]), float(time_s[at])),))


def _time_in_margin(
    measured: Measured, time_s: Doubles, gap_mm: Doubles, margin_mm: float
) -> Found:
    """Return the time spent nearer than the margin."""
    inside = gap_mm < margin_mm
    gap_s = measured.settings.gap_s
    spent = float(weights(time_s, gap_s)[inside].sum())
    return Found(spent, intervals(time_s, inside, gap_s))


def hazard_dose_s(
    time_s: Doubles, gap_mm: Doubles, margin_mm: float, gap_s: float
) -> float:
    """Return the integral of max(0, 1 - gap / margin), s, by the trapezoid rule."""
    depth = np.maximum(0.0, 1.0 - gap_mm / margin_mm)
    lasting = weights(time_s, gap_s)[:-1]
    return float((lasting * (depth[:-1] + depth[1:]) / 2.0).sum())


def _dose(
    measured: Measured, time_s: Doubles, gap_mm: Doubles, margin_mm: float
) -> Found:
    gap_s = measured.settings.gap_s
    dose = hazard_dose_s(time_s, gap_mm, margin_mm, gap_s)
    return Found(dose, intervals(time_s, gap_mm < margin_mm, gap_s))


def _near_misses(
    measured: Measured, time_s: Doubles, gap_mm: Doubles, margin_mm: float
) -> Found:
    """Return how often the margin was entered without entering the hazard."""
    settings = measured.settings
    clear_mm = margin_mm + settings.contact_close_mm
    state = held(gap_mm < margin_mm, gap_mm > clear_mm)
    spans = []
    for begin, end in intervals(time_s, state, settings.gap_s):
        within = (time_s >= begin) & (time_s <= end)
        if gap_mm[within].min() >= 0.0:
            spans.append((begin, end))
    return Found(float(len(spans)), tuple(spans))


def breaches(measured: Measured) -> Answer:
    """Return how often each structure was entered, found on the tools' swept ways."""
    if measured.breaches is None:
        return {"any": Found(None, (), "nobody operated: ways were not swept")}
    every = [breach.structure for breach in measured.breaches]
    found = {"any": every} | {name: [name] for name in dict.fromkeys(every)}
    answer = {}
    for name, structures in found.items():
        times = [b.time_s for b in measured.breaches if b.structure in structures]
        answer[name] = Found(float(len(times)), tuple((t, t) for t in times))
    return answer


_NEAR = (
    ("smallest distance", "mm", _smallest),
    ("time in margin", "s", _time_in_margin),
    ("hazard dose", "s", _dose),
    ("near misses", "count", _near_misses),
)

NEARNESS = frozenset(name for name, _, _ in _NEAR)
"""Metrics of how near something came to what must not be hurt."""

HAZARD = (
    *(
        Definition(name, role, unit, partial(_of_hazards, role=role, score=score))
        for role in (SCOPE, TOOL)
        for name, unit, score in _NEAR
    ),
    Definition("breaches", PATIENT, "count", breaches),
)
