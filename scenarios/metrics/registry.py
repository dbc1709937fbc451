"""Every metric by its name, and the computation of all of them."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from scenarios.metrics.cavity import CAVITY
from scenarios.metrics.contact import CONTACT
from scenarios.metrics.deviation import DEVIATION
from scenarios.metrics.fulcrum import FULCRUM
from scenarios.metrics.hazard import HAZARD
from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import Definition, Found, Metric
from scenarios.metrics.motion import MOTION
from scenarios.metrics.removal import REMOVAL
from scenarios.metrics.scope_view import SCOPE_VIEW
from scenarios.metrics.smoothness import SMOOTHNESS
from scenarios.metrics.surface_seen import SURFACE_SEEN
from scenarios.metrics.swept import SWEPT
from scenarios.metrics.track import Track
from scenarios.metrics.uncertainty import (
    LEAST_DRAWS,
    SEED,
    SessionNoise,
    disturbed,
    draw_count,
    spreads,
    still,
)
from scenarios.metrics.unlisted_tools import UNLISTED_TOOLS
from system import UserError

DEFINITIONS: tuple[Definition, ...] = (
    *MOTION,
    *SMOOTHNESS,
    *DEVIATION,
    *FULCRUM,
    *SCOPE_VIEW,
    *CONTACT,
    *HAZARD,
    *REMOVAL,
    *SURFACE_SEEN,
    *UNLISTED_TOOLS,
    *SWEPT,
    *CAVITY,
)
"""All metrics, in the order in which they are told. A new noun adds its own here."""


def definitions_named(names: Collection[str]) -> tuple[Definition, ...]:
    """Return the metrics of these names, of every role; UserError for unknown ones."""
    known = {definition.name for definition in DEFINITIONS}
    for name in names:
        if name not in known:
            raise UserError(
                f"There is no metric named {name!r}; known are: "
                f"{'; '.join(sorted(known))}."
            )
    return tuple(d for d in DEFINITIONS if d.name in names)


def measure(
    measured: Measured,
    noise: SessionNoise | None = None,
    chosen: tuple[Definition, ...] = DEFINITIONS,
) -> list[Metric]:
    """Compute metrics, with the share of the device's noise in them.

    noise: None for poses of unknown error; then there is no sigma and no floor. The
    same arguments give the same bits.
    """
    found = _values(measured, chosen)
    sigma: dict[str, float] = {}
    floor: dict[str, float] = {}
    if noise is not None:
        draws = draw_count(measured)
        sigma = _drawn(measured, noise, chosen, draws)
        floor = _floors(measured, noise, chosen)
    return [
        Metric(
            name,
            definition.role,
            definition.unit,
            answer.value,
            answer.reason,
            definition.filter,
            _sigma(answer, sigma.get(_key(definition, name))),
            None if answer.value is None else floor.get(_key(definition, name)),
            answer.intervals,
        )
        for definition, name, answer in found
    ]


def _sigma(answer: Found, drawn: float | None) -> float | None:
    """Return what a value may err by; what a metric tells of itself comes first."""
    if answer.value is None:
        return None
    return drawn if answer.sigma is None else answer.sigma


def _key(definition: Definition, name: str) -> str:
    return f"{definition.role}/{name}"


def _values(
    measured: Measured, chosen: tuple[Definition, ...]
) -> list[tuple[Definition, str, Found]]:
    return [
        (definition, name, found)
        for definition in chosen
        for name, found in definition.answers(measured).items()
    ]


def _as_needed(measured: Measured, chosen: tuple[Definition, ...]) -> Measured:
    """Leave out the tool where no metric reads it: each draw of it takes its time.

    What is left is disturbed alike with it and without it.
    """
    if any(definition.needs_tool for definition in chosen):
        return measured
    return replace(measured, tool=Track.none(), tool_hazards=None)


def _drawn(
    measured: Measured, noise: SessionNoise, chosen: tuple[Definition, ...], draws: int
) -> dict[str, float]:
    rng = np.random.default_rng(SEED)
    measured = _as_needed(measured, chosen)
    # the way without its noise, as well as it is known: noise is added to it once
    smooth = replace(
        measured,
        scope=measured.scope.smoothed(measured.settings),
        tool=measured.tool.smoothed(measured.settings),
    )
    values: dict[str, list[float]] = {}
    quick = tuple(definition for definition in chosen if not definition.is_slow)
    few: dict[str, list[float]] = {}
    for draw in range(draws):
        wanted = chosen if draw < LEAST_DRAWS else quick
        for definition, name, found in _values(disturbed(smooth, noise, rng), wanted):
            if found.value is not None:
                kept = few if definition.is_slow else values
                kept.setdefault(_key(definition, name), []).append(found.value)
    return spreads(values, draws) | spreads(few, min(draws, LEAST_DRAWS))


def _floors(
    measured: Measured, noise: SessionNoise, chosen: tuple[Definition, ...]
) -> dict[str, float]:
    """Return what tools held still would give for metrics of motion."""
    rng = np.random.default_rng(SEED)
    moving = tuple(definition for definition in chosen if definition.moves)
    resting = still(_as_needed(measured, moving), noise, rng)
    return {
        _key(definition, name): found.value
        for definition, name, found in _values(resting, moving)
        if found.value is not None
    }
